// Bent hexahedra of 27 nodes: their forces, tangents and masses.

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <string_view>

#include "mechanics/gravity_load.hpp"
#include "mechanics/mapped_hexahedron.hpp"
#include "mesh/shapes.hpp"
#include "solvers/assembly/level_assembler.hpp"
#include "support/level_forces.hpp"
#include "support/ranks.hpp"

namespace livetet {
namespace {

/// A block of 2 x 1 x 1 hexahedra, bent by a quadratic map.
TetMesh bent_block() {
    TetMesh mesh = shapes::box({0.02, 0.01, 0.01}, {4, 2, 2});
    for (Vector3& x : mesh.nodes)
        x += Vector3(3 * x.y() * x.y(), 5 * x.x() * x.z(), -4 * x.x() * x.y());
    std::vector<QuadraticHexahedron> cells(2);
    for (int c = 0; c < 2; ++c)
        for (int p = 0; p < 27; ++p) cells[c][p] = 2 * c + p % 3 + 5 * (p / 3 % 3 + 3 * (p / 9));
    mesh.tets.clear();
    return quadratic_hexahedra(std::move(mesh), std::move(cells), {}, "block");
}

/// The matrix and the products without it are the derivative of the forces, which are that of the
/// energy, in each model.
TEST(QuadraticHexahedraLevel, TangentIsTheDerivativeOfTheForces) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    TetMesh mesh = bent_block();
    mesh.shares = {1, 0.4};
    const std::size_t nodes = mesh.nodes.size();
    const auto u = test::rough_values(nodes, 1e-3, 1), v = test::rough_values(nodes, 1, 2);
    const std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.4}};
    for (const char* model : {"linear", "corotated", "neohookean", "mooney_rivlin"}) {
        LevelAssembler level(distribute_mesh(PETSC_COMM_SELF, mesh, {}), materials, model,
                             Formulation::displacement, MatrixLayout::blocks);
        const auto f = make_vector(level.share()), direction = make_vector(level.share());
        test::LevelForces forces(level, u, v);
        (void)forces.force(0);
        const Configuration at = forces.configuration();
        test::fill(level.share(), v, direction.get());
        level.assemble(at, {.stiffness = 1, .tangent = Tangent::exact});
        LIVETET_PETSC(MatMult(level.matrix(), direction.get(), f.get()));
        const auto product = test::gather(level.share(), f.get());
        LIVETET_PETSC(VecSet(f.get(), 0));
        level.add_stiffness_times(1, at, direction.get(), f.get());
        const auto without = test::gather(level.share(), f.get());
        if (std::string_view(model) == "corotated") {  // by frozen rotations
            level.assemble(at, {.stiffness = 1, .tangent = Tangent::frozen_rotation});
            LIVETET_PETSC(MatMult(level.matrix(), direction.get(), f.get()));
        } else {
            test::fill(level.share(), product, f.get());
        }
        const auto expected = test::gather(level.share(), f.get());
        for (std::size_t n = 0; n < nodes; ++n)
            EXPECT_LT((without[n] - expected[n]).norm(), 1e-9 * expected[n].norm() + 1e-12)
                << model;
        forces.expect_derivatives(product, 1e-8, model);
    }
}

TEST(QuadraticHexahedraLevel, MassAndWeightAreThoseOfTheBody) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    TetMesh mesh = bent_block();
    mesh.shares = {1, 0.5};
    const double volumes[2] = {mapped_hexahedron(mesh, 0).volume,
                               mapped_hexahedron(mesh, 1).volume};
    const double mass = 1000 * (volumes[0] + volumes[1]);
    mesh.shares.clear();
    EXPECT_NEAR(mapped_hexahedron(mesh, 1).volume, 2 * volumes[1], 1e-18);
    mesh.shares = {1, 0.5};
    const std::vector<Material> materials{{.young_Pa = 3000, .density_kg_per_m3 = 1000}};
    LevelAssembler level(distribute_mesh(PETSC_COMM_SELF, mesh, {}), materials, "linear",
                         Formulation::displacement, GeometryOnly{});
    level.find_mass();
    double sum = 0;
    for (const double m : level.node_mass()) {
        EXPECT_GT(m, 0);
        sum += m;
    }
    EXPECT_NEAR(sum, mass, 1e-12 * mass);
    Vector3 weight = Vector3::Zero();
    for (const Vector3& f : gravity_load(mesh, materials, {0, 1, -9.81})) weight += f;
    EXPECT_LT((weight - mass * Vector3(0, 1, -9.81)).norm(), 1e-12 * mass);
}

}  // namespace
}  // namespace livetet
