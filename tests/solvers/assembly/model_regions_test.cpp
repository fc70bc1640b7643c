#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "mechanics/materials/holzapfel_gasser_ogden.hpp"
#include "mesh/quadratic.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "support/shapes.hpp"

// Bodies whose regions are of different constitutive models.

namespace livetet {
namespace {

using test::nodes_where;

using test::beam_size;

/// A block of two halves along x, regions 1 and 2.
MeshHierarchy two_halves(bool quadratic) {
    TetMesh mesh = test::block({4, 2, 2}, beam_size);
    for (const Tet& t : mesh.tets) {
        double x = 0;
        for (const std::int32_t n : t) x += mesh.nodes[n].x() / 4;
        mesh.regions.push_back(x < beam_size.x() / 2 ? 1 : 2);
    }
    std::vector<TetMesh> levels{std::move(mesh)};
    MeshHierarchy hierarchy = make_hierarchy(std::move(levels), "two halves");
    return quadratic ? with_quadratic_level(std::move(hierarchy)) : std::move(hierarchy);
}

/// P11 of confined stretch, F = diag(l, 1, 1).
using Confined = std::function<double(const Material& m, double l)>;

double hooke_stress(const Material& m, double l) { return (m.lambda() + 2 * m.mu()) * (l - 1); }

double green_stress(const Material& m, double l) {
    return (m.lambda() + 2 * m.mu()) * (l * l * l - l) / 2;
}

/// Neo-Hookean with fibres along x: 2 l k1 E exp(k2 E^2) more than Hooke's law, E = l^2 - 1.
double fibre_stress(const Material& m, double l) {
    const HolzapfelGasserOgden defaults;
    const double E = l * l - 1;
    return hooke_stress(m, l) +
           (E > 0 ? 2 * l * defaults.k1_Pa * E * std::exp(defaults.k2 * E * E) : 0);
}

/// The stretch of the first half where both pull with one force at the mean stretch `mean`.
double first_stretch(const Confined& first, const Material& a, const Confined& second,
                     const Material& b, double mean) {
    double low = 0.6, high = 2 * mean - 0.6;
    for (int halving = 0; halving < 100; ++halving) {
        const double l = (low + high) / 2;
        (first(a, l) < second(b, 2 * mean - l) ? low : high) = l;
    }
    return low;
}

void expect_one_force(const char* model_1, const Confined& first, const char* model_2,
                      const Confined& second, bool quadratic, double mean) {
    const Material materials[] = {
        {.young_Pa = 3000, .poisson = 0.3, .region = 1, .model = model_1},
        {.young_Pa = 5000, .poisson = 0.2, .region = 2, .model = model_2}};
    const MeshHierarchy hierarchy = two_halves(quadratic);
    const TetMesh& mesh = hierarchy.levels.front();
    DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, "linear"}, {},
                        {.kind = SolverKind::direct});
    const auto all = nodes_where(mesh, [](const Vector3&) { return true; });
    const auto foot = nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; });
    const auto end =
        nodes_where(mesh, [](const Vector3& x) { return x.x() > beam_size.x() - 1e-9; });
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(all, Vector3::Zero(), 6);
    constraints.prescribe(foot, Vector3::Zero(), 1);
    constraints.prescribe(end, {(mean - 1) * beam_size.x(), 0, 0}, 1);
    body.set_constraints(constraints);
    ASSERT_TRUE(
        body.solve(0, {.max_newton = 60, .tolerance = 1e-12, .linear_tolerance = 1e-10}).converged);

    const double stretch = first_stretch(first, materials[0], second, materials[1], mean);
    const auto u = body.displacement();
    for (const std::int32_t n : nodes_where(
             mesh, [](const Vector3& x) { return std::abs(x.x() - beam_size.x() / 2) < 1e-9; }))
        EXPECT_NEAR(u[n].x(), (stretch - 1) * beam_size.x() / 2, 1e-9);
    double force = 0;
    const auto reactions = body.reactions();
    for (const std::int32_t n : end) force += reactions[n].x();
    const double expected = first(materials[0], stretch) * beam_size.y() * beam_size.z();
    EXPECT_NEAR(force, expected, 1e-7 * std::abs(expected));
}

TEST(ModelRegions, TwoHalvesOfDifferentModelsPullWithOneForce) {
    for (const bool quadratic : {false, true})
        for (const double mean : {0.85, 1.3}) {
            SCOPED_TRACE(fmt::format("{}, {}", quadratic ? "P2" : "P1", mean));
            expect_one_force("corotated", hooke_stress, "green", green_stress, quadratic, mean);
            expect_one_force("holzapfel_gasser_ogden", fibre_stress, "corotated", hooke_stress,
                             quadratic, mean);
            expect_one_force("linear", hooke_stress, "mooney_rivlin", hooke_stress, quadratic,
                             mean);
            expect_one_force("corotated", hooke_stress, "linear", hooke_stress, quadratic, mean);
        }
}

/// What one model computes for the whole body, it computes region by region too.
TEST(ModelRegions, OneModelByRegionIsTheModelOfTheBody) {
    const MeshHierarchy hierarchy = two_halves(false);
    const TetMesh& mesh = hierarchy.levels.front();
    const auto pressed = [&](const ModelChoice& body_model, const ModelChoice& own) {
        const Material materials[] = {{.young_Pa = 3000, .region = 1, .model = own},
                                      {.young_Pa = 9000, .region = 2, .model = own}};
        DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, body_model}, {},
                            {.kind = SolverKind::direct});
        Constraints constraints(mesh.nodes.size());
        constraints.prescribe(nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                              Vector3::Zero());
        constraints.prescribe(
            nodes_where(mesh, [](const Vector3& x) { return x.x() > beam_size.x() - 1e-9; }),
            Vector3(0.01, 0.02, -0.04));
        body.set_constraints(constraints);
        EXPECT_TRUE(body.solve(0, {.max_newton = 60, .tolerance = 1e-10, .linear_tolerance = 1e-8})
                        .converged);
        return body.displacement();
    };
    const auto by_body = pressed("neohookean", {}), by_region = pressed("linear", "neohookean"),
               corotated = pressed("corotated", {});
    double difference = 0, other = 0;
    for (std::size_t n = 0; n < by_body.size(); ++n) {
        difference = std::max(difference, (by_body[n] - by_region[n]).norm());
        other = std::max(other, (by_body[n] - corotated[n]).norm());
    }
    EXPECT_EQ(difference, 0);
    EXPECT_GT(other, 1e-4);
}

}  // namespace
}  // namespace livetet
