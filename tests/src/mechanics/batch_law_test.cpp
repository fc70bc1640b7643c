// Constitutive models over batches of tets with four and ten nodes and of hexahedra, against the
// same models point by point in double precision.

#include "mechanics/batch_law.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "mechanics/hex_kernels.hpp"
#include "mechanics/materials/corotated.hpp"
#include "mechanics/materials/kinematics.hpp"
#include "mechanics/materials/registry.hpp"
#include "mechanics/rotation.hpp"
#include "mesh/quadratic.hpp"
#include "support/element_of.hpp"
#include "support/hex_grids.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using Eigen::Matrix3d;

template <int nodes>
TetMesh block_of() {
    // Eight of nine cells of a row fill a batch; the others come together, in no row.
    if (nodes == 8) return test::hex_grid({9, 3, 2}, {1, 1.2, 0.7});
    TetMesh tets = test::block({3, 3, 2}, {1, 1.2, 0.7});
    return nodes == 10 ? quadratic_mesh(tets) : tets;
}

/// A block of elements of `nodes` nodes with moduli of their own, bent and pressed at random; its
/// nodes are moved by `axes` first.
template <int nodes>
struct BentBlock {
    TetMesh mesh = block_of<nodes>();
    std::vector<TetElement> elements;
    std::vector<std::array<std::int32_t, nodes>> tets;
    std::vector<float> u, v;  ///< displacement and direction, one number behind

    explicit BentBlock(double size, const Matrix3d& axes = Matrix3d::Identity()) {
        for (Vector3& x : mesh.nodes) x = axes * x;
        std::mt19937 generator(3);
        std::normal_distribution<double> normal;
        const std::size_t count = nodes == 8 ? mesh.hexahedra.size() : mesh.tets.size();
        for (std::size_t e = 0; e < count; ++e) {
            const Tet t = nodes == 8 ? test::corner_tet(mesh.hexahedra[e]) : mesh.tets[e];
            elements.push_back(make_element(
                {mesh.nodes[t[0]], mesh.nodes[t[1]], mesh.nodes[t[2]], mesh.nodes[t[3]]},
                5 + std::abs(normal(generator)), 1 + std::abs(normal(generator))));
            auto& of_element = tets.emplace_back();
            if constexpr (nodes == 8) {
                elements.back().volume = cell_volume(mesh) * (e == 3 ? 0.4 : 1);  // one in part
                of_element = mesh.hexahedra[e];
            } else {
                std::copy_n(t.begin(), 4, of_element.begin());
                for (int i = 4; i < nodes; ++i) of_element[i] = mesh.edge_nodes[e][i - 4];
            }
        }
        for (const Vector3& x : mesh.nodes)
            for (const double bent : {x.y() * x.z(), -x.x() * x.y(), x.x() * x.x()}) {
                u.push_back(static_cast<float>(size * (bent + 0.03 * normal(generator))));
                v.push_back(static_cast<float>(normal(generator)));
            }
        u.push_back(0);
        v.push_back(0);
    }
    Eigen::Matrix<double, 3, nodes> at(std::size_t e, const std::vector<float>& values) const {
        Eigen::Matrix<double, 3, nodes> all;
        for (int i = 0; i < nodes; ++i)
            for (int a = 0; a < 3; ++a) all(a, i) = values[3 * tets[e][i] + a];
        return all;
    }
    /// f += factor * sum over points of w stress(e, H, dF) grad N.
    template <class Stress>
    std::vector<double> sum(double factor, Stress&& stress) const {
        using Shape = ElementShape<nodes>;
        std::vector<double> f(u.size(), 0.0);
        for (std::size_t e = 0; e < tets.size(); ++e)
            for (int q = 0; q < Shape::points; ++q) {
                const auto g = Shape::gradients(elements[e], q);
                const Matrix3d H = at(e, u) * g.transpose(), dF = at(e, v) * g.transpose();
                const auto nodal =
                    (factor * elements[e].volume / Shape::points * stress(e, H, dF) * g).eval();
                for (int i = 0; i < nodes; ++i)
                    for (int a = 0; a < 3; ++a) f[3 * tets[e][i] + a] += nodal(a, i);
            }
        return f;
    }
};

Matrix3d rotation_in(const ConstitutiveModel& model, const Matrix3d& H) {
    return model.kinematics() == Kinematics::corotated ? rotation_of(deformation_gradient(H))
                                                       : Matrix3d::Identity();
}

void expect_near(const std::vector<float>& got, const std::vector<double>& expected,
                 const std::string& what) {
    double largest = 0;
    for (const double x : expected) largest = std::max(largest, std::abs(x));
    for (std::size_t k = 0; k < got.size(); ++k)
        ASSERT_NEAR(got[k], expected[k], 5e-6 * largest + 3e-7) << what << ' ' << k;
}

/// Derivatives in the middle of an element by the places at rest.
TetShape<10>::Gradients central_gradients(const BentBlock<10>& block, std::size_t e) {
    return TetShape<10>::gradients_at(block.elements[e], Eigen::Vector4d::Constant(0.25));
}
ElementShape<8>::Gradients central_gradients(const BentBlock<8>& block, std::size_t e) {
    return block.elements[e].gradients.rightCols<3>() *
           ElementShape<8>::local_gradients(Eigen::Vector3d::Constant(0.5));
}

/// At u, for a model that reads them: of each point, or of each cell for products of other laws
/// than Hooke's.
template <int nodes>
std::vector<RotationBatch<float>> rotations_of(const ConstitutiveModel& model,
                                               const TetBatches<float, nodes>& batches,
                                               std::span<const float> u) {
    const bool of_cells = nodes == 8 && !model.is_hooke_by_rotation();
    if (!of_cells && model.kinematics() != Kinematics::corotated)
        return TetBatches<float>::make_fixed_rotations();
    std::vector<RotationBatch<float>> rotations((of_cells ? 1 : batches.points) *
                                                batches.all().end);
    update_rotations(batches, batches.all(), u, std::span(rotations));
    return rotations;
}

/// The bounded tangent's stress at a point. In a box of moderate strain it is that of the mean
/// gradient, in the cell's middle, and Hooke's of what the point's gradient is beside the mean.
template <int nodes>
Matrix3d product_at(const ConstitutiveModel& model, const BentBlock<nodes>& block, std::size_t e,
                    bool is_moderate, const Matrix3d& H, const Matrix3d& dF) {
    const TetElement& element = block.elements[e];
    const auto tangent = [&](const Matrix3d& at, const Matrix3d& direction) {
        return model.bounded_increment(element.lambda, element.mu, at, rotation_in(model, at),
                                       direction);
    };
    if constexpr (nodes == 8)
        if (!model.is_hooke_by_rotation() && is_moderate) {
            const auto middle = central_gradients(block, e);
            const Matrix3d H_mean = block.at(e, block.u) * middle.transpose(),
                           dF_mean = block.at(e, block.v) * middle.transpose(),
                           R = rotation_of(deformation_gradient(H_mean));
            const Matrix3d strain = R.transpose() * (dF - dF_mean);
            return tangent(H_mean, dF_mean) +
                   R * (element.mu * (strain + strain.transpose()) +
                        element.lambda * strain.trace() * Matrix3d::Identity());
        }
    return tangent(H, dF);
}

/// What a point's stress and volume strain change by in the mixed form: the increment at held p,
/// and N. In a box of moderate strain as product_at has it.
template <int nodes>
std::pair<Matrix3d, Matrix3d> mixed_product_at(const ConstitutiveModel& model,
                                               const BentBlock<nodes>& block, std::size_t e,
                                               bool is_moderate, double p, const Matrix3d& H,
                                               const Matrix3d& dF) {
    const double mu = block.elements[e].mu;
    if constexpr (nodes == 8)
        if (!model.is_hooke_by_rotation() && is_moderate) {
            const auto middle = central_gradients(block, e);
            const Matrix3d H_mean = block.at(e, block.u) * middle.transpose(),
                           dF_mean = block.at(e, block.v) * middle.transpose(),
                           R = rotation_of(deformation_gradient(H_mean)),
                           strain = R.transpose() * (dF - dF_mean),
                           of_law = rotation_in(model, H_mean);
            return {model.shear_stress_increment(mu, p, H_mean, of_law, dF_mean) +
                        R * mu * (strain + strain.transpose()),
                    model.volume_strain_gradient(H_mean, of_law)};
        }
    const Matrix3d R = rotation_in(model, H);
    return {model.shear_stress_increment(mu, p, H, R, dF), model.volume_strain_gradient(H, R)};
}

Matrix3d oblique() {
    return Eigen::AngleAxisd(0.8, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
}

/// As the voxels of many images lie: to the left, to the back and upwards.
Matrix3d backwards() { return Vector3(-1, -1, 1).asDiagonal(); }

/// `law` on the block in two parts against `model`, strained by about `size`.
template <int nodes>
void compare(const ConstitutiveModel& model, const BatchLaw& law, double size,
             const Matrix3d& axes = Matrix3d::Identity()) {
    const BentBlock<nodes> block(size, axes);
    const TetBatches<float, nodes> batches(test::element_of(block.elements), block.tets,
                                           part_batches(block.tets, 2, batch_width<float>));
    const auto rotations = rotations_of(model, batches, block.u);
    const std::string what = fmt::format("{}, {} nodes", model.name(), nodes);
    std::vector<float> f(block.u.size(), 0.0F);
    law.add_forces(batches, batches.all(), rotations, block.u, f);
    expect_near(f,
                block.sum(1,
                          [&](std::size_t e, const Matrix3d& H, const Matrix3d&) {
                              const TetElement& element = block.elements[e];
                              const Matrix3d R = rotation_in(model, H);
                              return model.stress(element.mu,
                                                  element.lambda * model.volume_strain(H, R), H, R);
                          }),
                what + ", forces");
    f.assign(f.size(), 0.0F);
    law.add_stiffness_times(-0.3F, batches, batches.all(), rotations, block.u, block.v, f);
    expect_near(f,
                block.sum(-0.3,
                          [&](std::size_t e, const Matrix3d& H, const Matrix3d& dF) {
                              return product_at(model, block, e, size < 0.2, H, dF);
                          }),
                what + ", products");
}

TEST(BatchLaw, ForcesAndProductsAreThoseOfTheModels) {
    for (const ConstitutiveModel* model : registered_materials()) {
        const BatchLaw* law = model->is_hooke_by_rotation() ? &hooke_law() : model->batch_law();
        if (!law) continue;
        for (const double size : {1e-3, 0.3}) {
            compare<4>(*model, *law, size);
            compare<10>(*model, *law, size);
        }
        for (const double size : {1e-3, 0.1, 1.5}) {
            compare<8>(*model, *law, size);
            for (const Matrix3d& axes : {oblique(), backwards()})
                compare<8>(*model, *law, size, axes);
        }
    }
}

/// The kernels of ten nodes in double precision against Corotated at each point. The larger
/// displacement inverts points, which have no tangent of the usual form.
TEST(BatchLaw, TenNodesInDoublePrecisionAreThoseOfCorotated) {
    const Corotated model;
    for (const double size : {1e-3, 0.3, 1.5}) {
        const BentBlock<10> block(size);
        const std::vector<double> u(block.u.begin(), block.u.end()),
            v(block.v.begin(), block.v.end());
        const TetBatches<double, 10> batches(test::element_of(block.elements), block.tets);
        auto r = batches.make_rotations();
        update_rotations(batches, batches.all(), std::span(u), std::span(r));
        const std::span<const RotationBatch<double>> R(r);
        std::vector<double> f(u.size());
        const auto expect = [&](double factor, const char* what, auto&& stress) {
            const std::vector<double> expected = block.sum(factor, stress);
            double largest = 0;
            for (const double x : expected) largest = std::max(largest, std::abs(x));
            for (std::size_t k = 0; k < f.size(); ++k)
                ASSERT_NEAR(f[k], expected[k], 1e-10 * largest) << what << ' ' << size << ' ' << k;
            f.assign(f.size(), 0.0);
        };
        const auto p = [&](std::size_t e, const Matrix3d& H) {
            return block.elements[e].lambda * model.volume_strain(H, rotation_in(model, H));
        };
        add_forces(batches, batches.all(), R, std::span(u), std::span(f));
        expect(1, "forces", [&](std::size_t e, const Matrix3d& H, const Matrix3d&) {
            return model.stress(block.elements[e].mu, p(e, H), H, rotation_in(model, H));
        });
        add_stiffness_times(0.7, batches, batches.all(), R, std::span(v), std::span(f));
        expect(0.7, "products", [&](std::size_t e, const Matrix3d& H, const Matrix3d& dF) {
            return model.bounded_increment(block.elements[e].lambda, block.elements[e].mu, H,
                                           rotation_in(model, H), dF);
        });
        for (const Tangent tangent : {Tangent::exact, Tangent::positive}) {
            add_tangent_times<10>(0.7, batches, batches.all(), R, u, tangent, v, f);
            expect(0.7, "tangent", [&](std::size_t e, const Matrix3d& H, const Matrix3d& dF) {
                const Matrix3d N = rotation_in(model, H);
                const Eigen::Matrix<double, 9, 1> dP =
                    model.shear_tangent(block.elements[e].mu, p(e, H), H, tangent) * dF.reshaped();
                return Matrix3d(dP.reshaped(3, 3) +
                                block.elements[e].lambda * N.cwiseProduct(dF).sum() * N);
            });
        }
    }
}

/// The mixed form of `law` against `model`: f, g and their derivative, summed point by point.
template <int nodes>
void compare_mixed(const ConstitutiveModel& model, const MixedLaw& law, double size,
                   const Matrix3d& axes = Matrix3d::Identity()) {
    using Shape = ElementShape<nodes>;
    BentBlock<nodes> block(size, axes);
    // The pressures of an element: of its corners, or its own, four times.
    const auto pressures_of = [&](std::size_t e) {
        const auto own = static_cast<std::int32_t>(e);
        return nodes == 8
                   ? Tet{own, own, own, own}
                   : Tet{block.tets[e][0], block.tets[e][1], block.tets[e][2], block.tets[e][3]};
    };
    constexpr double modulus = 2.5;  // the batches hold the volume times this instead of lambda
    for (TetElement& e : block.elements) e.lambda = modulus;
    const TetBatches<float, nodes> batches(test::element_of(block.elements), block.tets,
                                           part_batches(block.tets, 2, batch_width<float>));
    const auto rotations = rotations_of(model, batches, block.u);
    const std::size_t count = std::max(block.u.size() / 3, block.tets.size());
    std::vector<float> p(count), q(count);
    for (std::size_t i = 0; i < count; ++i) {
        p[i] = static_cast<float>(std::sin(3.0 * i));
        q[i] = static_cast<float>(std::cos(5.0 * i));
    }
    // {f, g}, {products}, {B^T q}, point by point.
    constexpr double factor = -0.3;
    std::vector<double> f(block.u.size()), g(count), Kv(f), Bv(g), Bq(f);
    for (std::size_t e = 0; e < block.tets.size(); ++e)
        for (int point = 0; point < Shape::points; ++point) {
            const TetElement& element = block.elements[e];
            const auto gradients = Shape::gradients(element, point);
            const Eigen::Vector4d L = Shape::coordinates(point);
            const Matrix3d H = block.at(e, block.u) * gradients.transpose(),
                           dF = block.at(e, block.v) * gradients.transpose(),
                           R = rotation_in(model, H);
            double of_p = 0, of_q = 0;
            for (int i = 0; i < 4; ++i) {
                of_p += L[i] * p[pressures_of(e)[i]];
                of_q += L[i] * q[pressures_of(e)[i]];
            }
            const double w = element.volume / Shape::points;
            const auto [of_shape, N] = mixed_product_at(model, block, e, size < 0.2, of_p, H, dF);
            const Matrix3d P = model.stress(element.mu, of_p, H, R),
                           dP = factor * of_shape + of_q * N;
            for (int i = 0; i < nodes; ++i)
                for (int a = 0; a < 3; ++a) {
                    const std::size_t k = 3 * block.tets[e][i] + a;
                    f[k] += w * P.row(a).dot(gradients.col(i));
                    Kv[k] += w * dP.row(a).dot(gradients.col(i));
                    Bq[k] += w * of_q * N.row(a).dot(gradients.col(i));
                }
            for (int i = 0; i < 4; ++i) {
                g[pressures_of(e)[i]] += w * L[i] * model.volume_strain(H, R);
                Bv[pressures_of(e)[i]] += w * L[i] * N.cwiseProduct(dF).sum();
            }
        }
    const MixedTets<nodes> tets{batches, 1 / static_cast<float>(modulus), batches.all(), rotations};
    const std::string what(model.name());
    std::vector<float> got_f(f.size()), got_g(g.size());
    law.add_forces(tets, {block.u, p}, {got_f, got_g});
    expect_near(got_f, f, what + ", forces with pressures");
    expect_near(got_g, g, what + ", volumes");
    got_f.assign(f.size(), 0.0F);
    got_g.assign(g.size(), 0.0F);
    law.add_products(tets, factor, {block.u, p}, {block.v, q}, {got_f, got_g});
    expect_near(got_f, Kv, what + ", products with pressures");
    expect_near(got_g, Bv, what + ", B v");
    got_f.assign(f.size(), 0.0F);
    law.add_pressure_forces(tets, {block.u, {}}, q, got_f);
    expect_near(got_f, Bq, what + ", B^T q");
}

TEST(BatchLaw, TheMixedFormIsThatOfTheModels) {
    for (const ConstitutiveModel* model : registered_materials()) {
        const BatchLaw* law = model->is_hooke_by_rotation() ? &hooke_law() : model->batch_law();
        if (!law) continue;
        for (const double size : {1e-3, 0.3}) {
            compare_mixed<4>(*model, law->mixed(), size);
            compare_mixed<10>(*model, law->mixed(), size);
        }
        for (const double size : {1e-3, 0.1, 1.5}) {
            compare_mixed<8>(*model, law->mixed(), size);
            for (const Matrix3d& axes : {oblique(), backwards()})
                compare_mixed<8>(*model, law->mixed(), size, axes);
        }
    }
}

template <int nodes>
void compare_rotations(const Matrix3d& axes) {
    const BentBlock<nodes> block(0.3, axes);
    const TetBatches<float, nodes> batches(test::element_of(block.elements), block.tets);
    std::vector<RotationBatch<float>> one(batches.all().end);
    update_rotations(batches, batches.all(), std::span<const float>(block.u), std::span(one));
    for (std::size_t lane = 0; lane < block.tets.size(); ++lane) {
        const std::int32_t e = batches.tet_at(lane / 8, lane % 8);
        if (e < 0) continue;
        const auto g = central_gradients(block, e);
        const Matrix3d R = rotation_of(deformation_gradient(block.at(e, block.u) * g.transpose()));
        ASSERT_LT((rotation_at<float>(one, lane) - R).norm(), 1e-5) << e;
    }
    std::vector<RotationBatch<float>> all;
    for (const RotationBatch<float>& r : one) all.insert(all.end(), batches.points, r);
    std::vector<float> f(block.u.size(), 0.0F), g(f);
    hooke_law().add_stiffness_times(0.7F, batches, batches.all(), one, block.u, block.v, f);
    hooke_law().add_stiffness_times(0.7F, batches, batches.all(), all, block.u, block.v, g);
    expect_near(f, {g.begin(), g.end()}, "component");
}

TEST(BatchLaw, OneRotationAnElementIsTakenAtItsCentreAndServesAllItsPoints) {
    compare_rotations<10>(Matrix3d::Identity());
    // Boxes with one rotation have a product of their own: those of an oblique grid, too.
    compare_rotations<8>(Matrix3d::Identity());
    compare_rotations<8>(oblique());
    compare_rotations<8>(backwards());
}

TEST(BatchLaw, CellsThatAreNoBoxesTakeThePointsOfAnyHexahedron) {
    Matrix3d skewed = oblique();
    skewed.col(0) += 0.3 * skewed.col(1);
    compare_rotations<8>(skewed);
}

std::vector<bool> rows_of(const BentBlock<8>& block) {
    const TetBatches<float, 8> batches(test::element_of(block.elements), block.tets);
    std::vector<bool> rows;
    for (std::size_t k = 0; k < batches.all().end; ++k) rows.push_back(batches[k].is_row);
    return rows;
}

TEST(BatchLaw, WholeRowsOfCellsComeFirstAndAreKnown) {
    BentBlock<8> block(0.1);
    EXPECT_EQ(rows_of(block), (std::vector{true, true, true, true, true, true, false}));
    // What has other numbers, as nodes that a cut has doubled have, is in no row.
    for (auto& cell : block.tets)
        for (std::int32_t& n : cell)
            if (n == 4) n = static_cast<std::int32_t>(block.mesh.nodes.size());
    EXPECT_EQ(rows_of(block), (std::vector{true, true, true, true, true, false, false}));
}

TEST(BatchLaw, CellsAlignedWithTheBodysAxesAreKnown) {
    const auto axes_of = [](const Matrix3d& axes) {
        const BentBlock<8> block(0.1, axes);
        return TetBatches<float, 8>(test::element_of(block.elements), block.tets).axes();
    };
    EXPECT_EQ(axes_of(Matrix3d::Identity()), CellAxes::aligned);
    EXPECT_EQ(axes_of(backwards()), CellAxes::aligned);
    EXPECT_EQ(axes_of(oblique()), CellAxes::any);
}

}  // namespace
}  // namespace livetet
