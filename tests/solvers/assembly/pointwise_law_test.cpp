// The law that calls the models' functions against those that are written for lanes.

#include "solvers/assembly/pointwise_law.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "mechanics/materials/registry.hpp"
#include "mesh/quadratic.hpp"
#include "support/element_of.hpp"
#include "support/hex_grids.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// In the mixed form: forces, volumes, products and B^T q, one behind the other.
template <int nodes>
std::vector<float> mixed_results(const MixedLaw& law, const MixedTets<nodes>& tets,
                                 const MixedValues& at, const MixedValues& v) {
    std::vector<float> all;
    const auto take = [&](auto&& add) {
        std::vector<float> f(at.u.size()), g(at.p.size());
        add(f, g);
        all.insert(all.end(), f.begin(), f.end());
        all.insert(all.end(), g.begin(), g.end());
    };
    take([&](auto& f, auto& g) { law.add_forces(tets, at, {f, g}); });
    take([&](auto& f, auto& g) { law.add_products(tets, 0.7F, at, v, {f, g}); });
    take([&](auto& f, auto&) { law.add_pressure_forces(tets, at, v.p, f); });
    return all;
}

template <int nodes>
void compare_with_lanes(const ConstitutiveModel& model) {
    const TetMesh mesh = nodes == 8 ? test::hex_grid({3, 2, 2}, {1, 0.8, 0.7})
                                    : quadratic_mesh(test::block({3, 2, 2}, {1, 0.8, 0.7}));
    const std::vector<PointwiseModels::Moduli> moduli{{9, 1.5, model}, {4, 2, model}};
    std::vector<TetElement> elements;
    std::vector<std::array<std::int32_t, nodes>> tets;
    std::vector<std::int32_t> region;
    for (std::size_t e = 0; e < (nodes == 8 ? mesh.hexahedra.size() : mesh.tets.size()); ++e) {
        const Tet t = nodes == 8 ? test::corner_tet(mesh.hexahedra[e]) : mesh.tets[e];
        region.push_back(e % 3 == 0);
        elements.push_back(
            make_element({mesh.nodes[t[0]], mesh.nodes[t[1]], mesh.nodes[t[2]], mesh.nodes[t[3]]},
                         moduli[region[e]].lambda, moduli[region[e]].mu));
        auto& of_element = tets.emplace_back();
        if constexpr (nodes == 8) {
            of_element = mesh.hexahedra[e];
            continue;
        }
        std::copy_n(t.begin(), 4, of_element.begin());
        for (int i = 4; i < nodes; ++i) of_element[i] = mesh.edge_nodes[e][i - 4];
    }
    std::vector<float> u, v;
    for (const Vector3& x : mesh.nodes)
        for (int a = 0; a < 3; ++a) {
            u.push_back(static_cast<float>(0.2 * x[a] * x[(a + 1) % 3]));
            v.push_back(static_cast<float>(std::sin(7 * x[(a + 2) % 3] + a)));
        }
    u.push_back(0);
    v.push_back(0);
    const TetBatches<float, nodes> batches(test::element_of(elements), tets);
    std::vector<RotationBatch<float>> rotations(batches.points * batches.all().end);
    update_rotations(batches, batches.all(), std::span<const float>(u), std::span(rotations));
    for (TetElement& e : elements) e.lambda = 3;  // the volumes of the mixed form, times 3 Pa
    const TetBatches<float, nodes> of_mixed(test::element_of(elements), tets);
    const BatchLaw& lanes = model.is_hooke_by_rotation() ? hooke_law() : *model.batch_law();
    const PointwiseLaw points(PointwiseModels(moduli, region));
    std::vector<float> f[2], g[2];
    for (int k = 0; k < 2; ++k) {
        const BatchLaw& law = k == 0 ? lanes : points;
        f[k].assign(u.size(), 0.0F);
        g[k].assign(u.size(), 0.0F);
        law.add_forces(batches, batches.all(), rotations, u, f[k]);
        law.add_stiffness_times(0.7F, batches, batches.all(), rotations, u, v, g[k]);
    }
    std::vector<float> p(mesh.nodes.size()), q(p);
    for (std::size_t i = 0; i < p.size(); ++i)
        p[i] = static_cast<float>(std::sin(3.0 * i)), q[i] = static_cast<float>(std::cos(i));
    const MixedTets<nodes> all{of_mixed, 1.0F / 3, of_mixed.all(), rotations};
    const auto one = mixed_results(lanes.mixed(), all, {u, p}, {v, q}),
               other = mixed_results(points.mixed(), all, {u, p}, {v, q});
    for (std::size_t i = 0; i < one.size(); ++i)
        ASSERT_NEAR(one[i], other[i], 2e-5) << model.name() << ' ' << nodes << " mixed " << i;
    for (std::size_t i = 0; i < u.size(); ++i) {
        ASSERT_NEAR(f[0][i], f[1][i], 1e-5) << model.name() << ' ' << nodes << ' ' << i;
        ASSERT_NEAR(g[0][i], g[1][i], 1e-4) << model.name() << ' ' << nodes << ' ' << i;
    }
}

TEST(PointwiseLaw, IsTheLawOfLanesTetByTet) {
    for (const char* name : {"corotated", "green", "neohookean"}) {
        compare_with_lanes<4>(registered_material(name));
        compare_with_lanes<8>(registered_material(name));
        compare_with_lanes<10>(registered_material(name));
    }
}

}  // namespace
}  // namespace livetet
