// Bodies of hexahedra: exact where the elements are, convergent elsewhere, in few iterations.

#include "solvers/linear/hex_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>
#include <numbers>

#include "base/error.hpp"
#include "mechanics/gravity_load.hpp"
#include "solvers/nonlinear/cell_pressures.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "support/hex_grids.hpp"
#include "support/level_forces.hpp"
#include "support/petsc_options.hpp"
#include "support/ranks.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

const SolveControls hex_tight{.max_newton = 60, .tolerance = 1e-10, .linear_tolerance = 1e-10};

MeshHierarchy alone(TetMesh mesh) { return make_hierarchy({std::move(mesh)}, "a grid"); }

template <class Where>
std::vector<std::int32_t> grid_nodes(const TetMesh& mesh, Where&& where) {
    std::vector<std::int32_t> nodes;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        if (where(mesh.nodes[n])) nodes.push_back(static_cast<std::int32_t>(n));
    return nodes;
}

/// A body with a step takes a linear displacement of its border exactly,
/// whatever the model and form.
TEST(HexSolver, PassesThePatchTest) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const MeshHierarchy hierarchy =
        alone(test::hex_grid({5, 4, 6}, {0.05, 0.06, 0.03},
                             [](const Vector3& x) { return x.x() < 0.03 || x.z() < 0.015; }));
    const TetMesh& grid = hierarchy.levels.front();
    Eigen::Matrix3d H;
    H << 0.02, 0.01, -0.03, 0.015, -0.01, 0.02, 0.01, 0.005, 0.03;
    const auto border = nodes_of(boundary_triangles(grid.tets));
    for (const char* model : {"linear", "corotated", "neohookean"})
        for (const Formulation form : {Formulation::displacement, Formulation::mixed}) {
            const std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.4}};
            DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, model, form}, {}, {});
            Constraints constraints(grid.nodes.size());
            for (const std::int32_t n : border)
                constraints.prescribe(std::span(&n, 1), H * grid.nodes[n]);
            body.set_constraints(constraints);
            const StepReport report =
                body.solve(0, {.max_newton = 60, .tolerance = 1e-13, .linear_tolerance = 1e-12});
            ASSERT_TRUE(report.converged) << model << ": " << report.reason;
            const auto u = body.displacement();
            for (std::size_t n = 0; n < u.size(); ++n)
                ASSERT_LT((u[n] - H * grid.nodes[n]).norm(), 1e-10 * 0.06) << model << n;
        }
}

/// K v is the derivative of the forces, in each model and form.
TEST(HexSolver, TangentIsTheDerivativeOfTheForces) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    TetMesh mesh = test::hex_grid({3, 2, 2}, {0.03, 0.02, 0.02});
    mesh.shares[3] = 0.4;
    const MeshHierarchy hierarchy = alone(std::move(mesh));
    const std::size_t nodes = hierarchy.levels.front().nodes.size();
    const std::vector<Vector3> u = test::rough_values(nodes, 0.006, 1),
                               v = test::rough_values(nodes, 1, 2);
    for (const char* model : {"linear", "corotated", "neohookean", "green", "mooney_rivlin"})
        for (const Formulation form : {Formulation::displacement, Formulation::mixed}) {
            std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.45}};
            materials[0].model = ModelChoice(model);
            LevelAssembler level(distribute_mesh(PETSC_COMM_SELF, hierarchy.levels.front(), {}),
                                 materials, "corotated", form, GeometryOnly{});
            test::LevelForces forces(level, u, v);
            (void)forces.force(0);
            std::vector<double> direction, product(3 * nodes, 0.0);
            for (const Vector3& x : v) direction.insert(direction.end(), x.begin(), x.end());
            level.add_hexahedra_times(1, Tangent::exact, forces.configuration(), direction,
                                      product);
            std::vector<Vector3> products;
            for (std::size_t n = 0; n < nodes; ++n)
                products.emplace_back(product[3 * n], product[3 * n + 1], product[3 * n + 2]);
            forces.expect_derivatives(products, 1e-7,
                                      fmt::format("{}, {}", model, static_cast<int>(form)));
        }
}

/// With pressures p of cells given, forces are those at p, and K v the derivative of the forces at
/// pressures that follow, p + lambda d theta : v.
TEST(HexSolver, TangentAtGivenPressures) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    TetMesh mesh = test::hex_grid({3, 2, 2}, {0.03, 0.02, 0.02});
    mesh.shares[3] = 0.4;
    const MeshHierarchy hierarchy = alone(std::move(mesh));
    const TetMesh& grid = hierarchy.levels.front();
    const std::vector<Vector3> u = test::rough_values(grid.nodes.size(), 0.006, 1),
                               v = test::rough_values(grid.nodes.size(), 1, 2);
    for (const char* model : {"corotated", "neohookean", "mooney_rivlin"}) {
        const std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.45}};
        LevelAssembler level(distribute_mesh(PETSC_COMM_SELF, grid, {}), materials, model,
                             Formulation::mixed, GeometryOnly{});
        const auto p = level.make_cell_vector(), step = level.make_cell_vector();
        const auto along = level.make_vector();
        test::fill(level.share(), v, along.get());
        test::LevelForces forces(level, u, v);
        const std::vector<Vector3> eliminated = forces.force(0);
        level.find_cell_pressures(forces.configuration(), nullptr, p.get());
        const std::vector<Vector3> given = forces.force(0, p.get());
        for (std::size_t n = 0; n < given.size(); ++n)
            ASSERT_LT((given[n] - eliminated[n]).norm(), 1e-12) << model << n;

        level.find_cell_pressures(forces.configuration(), along.get(), step.get());
        LIVETET_PETSC(VecAXPY(step.get(), -1, p.get()));  // lambda d theta : v
        LIVETET_PETSC(VecShift(p.get(), 500));            // far from those of u
        std::vector<double> direction, product(3 * v.size(), 0.0);
        for (const Vector3& x : v) direction.insert(direction.end(), x.begin(), x.end());
        Configuration at = forces.configuration();
        at.p = p.get();
        level.add_hexahedra_times(1, Tangent::exact, at, direction, product);
        constexpr double h = 1e-6;
        LIVETET_PETSC(VecAXPY(p.get(), h, step.get()));
        const std::vector<Vector3> after = forces.force(h, p.get());
        LIVETET_PETSC(VecAXPY(p.get(), -2 * h, step.get()));
        const std::vector<Vector3> before = forces.force(-h, p.get());
        double largest = 0;
        for (const double x : product) largest = std::max(largest, std::abs(x));
        for (std::size_t n = 0; n < v.size(); ++n)
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR((after[n][c] - before[n][c]) / (2 * h), product[3 * n + c],
                            1e-6 * largest)
                    << model << n;
    }
}

/// A ragged body: an ellipsoid with holes three cells wide and a cut from one side.
TetMesh ragged(int n) {
    return test::hex_grid({n, n, n}, {0.1, 0.1, 0.1}, [n](const Vector3& x) {
        const Vector3 c = (x - Vector3::Constant(0.05)) / 0.05;
        const bool hole = (c - Vector3(0.3, 0.2, 0.1)).norm() < 0.3 ||
                          (c - Vector3(-0.4, -0.3, 0.3)).norm() < 0.25;
        const bool cut = std::abs(c.x() + 0.1) < 1.5 / n && c.y() > 0;
        return c.norm() < 1 && !hole && !cut;
    });
}

/// f -= factor V (lambda - what is damped) b b^T v of each cell, b its dilation.
void subtract_volume(const LevelAssembler& level, const Configuration& at, double factor, Vec v,
                     Vec f) {
    const std::vector<CellDilation> dilations = level.cell_dilations(at);
    const ReadArray from(v);
    WriteArray to(f);
    for (std::size_t e = 0; e < dilations.size(); ++e) {
        const Hexahedron& cell = level.share().hexahedra[e];
        const TetElement element = level.element(e);
        double change = 0;
        for (int c = 0; c < 8; ++c)
            for (int d = 0; d < 3; ++d) change += dilations[e](d, c) * from[3 * cell[c] + d];
        for (int c = 0; c < 8; ++c)
            for (int d = 0; d < 3; ++d)
                to[3 * cell[c] + d] -= factor * element.volume *
                                       (element.lambda - 10 * element.mu) * change *
                                       dilations[e](d, c);
    }
}

/// What a grid keeps to damp by is the positive part of the tangent, in each model and form; in the
/// mixed form with at most ten times mu for the volume.
TEST(HexSolver, DampsByThePositiveTangentThatItKept) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    TetMesh mesh = test::hex_grid({3, 2, 2}, {0.03, 0.02, 0.02});
    mesh.shares[3] = 0.4;
    const MeshHierarchy hierarchy = alone(std::move(mesh));
    const std::size_t nodes = hierarchy.levels.front().nodes.size();
    const std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.47}};
    for (const ModelChoice& model : ModelChoice::alternatives())
        for (const Formulation form : {Formulation::displacement, Formulation::mixed}) {
            LevelAssembler level(distribute_mesh(PETSC_COMM_SELF, hierarchy.levels.front(), {}),
                                 materials, model, form, GeometryOnly{});
            const auto u = level.make_vector(), v = level.make_vector();
            const auto kept = level.make_vector(), expected = level.make_vector();
            const auto fill = [&](Vec to, double size, unsigned seed) {
                const std::vector<Vector3> values = test::rough_values(nodes, size, seed);
                WriteArray array(to);
                for (std::size_t n = 0; n < nodes; ++n)
                    for (int c = 0; c < 3; ++c) array[3 * n + c] = values[n][c];
            };
            fill(u.get(), 0.002, 1);
            fill(v.get(), 1, 2);
            ElementRotations rotations = level.make_rotations();
            level.update_rotations(u.get(), rotations);
            const Configuration at{.u = u.get(), .rotations = &rotations};
            ASSERT_TRUE(level.keeps_damping());
            level.keep_damping(at);
            level.add_damping_times(0.5, v.get(), kept.get());
            level.add_hexahedra_times(0.5, Tangent::positive, at, ReadArray(v.get()).span(),
                                      WriteArray(expected.get()).span());
            if (form == Formulation::mixed)
                subtract_volume(level, at, 0.5, v.get(), expected.get());
            PetscReal size = 0, gap = 0;
            PetscScalar work = 0;
            LIVETET_PETSC(VecNorm(expected.get(), NORM_2, &size));
            LIVETET_PETSC(VecDot(kept.get(), v.get(), &work));
            LIVETET_PETSC(VecAXPY(kept.get(), -1, expected.get()));
            LIVETET_PETSC(VecNorm(kept.get(), NORM_2, &gap));
            EXPECT_LT(gap, 1e-5 * size) << model.name() << ", " << static_cast<int>(form);
            EXPECT_GT(work, 0) << model.name();
        }
}

TEST(HexSolver, TakesFewIterationsOnAnyNumberOfCells) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    for (const auto& [poisson, most] : {std::pair{0.3, 13}, {0.45, 18}})
        for (const int n : {16, 32, 58}) {
            const MeshHierarchy hierarchy = alone(ragged(n));
            const TetMesh& mesh = hierarchy.levels.front();
            const std::vector<Material> materials{{.young_Pa = 3000, .poisson = poisson}};
            DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, "linear"}, {}, {});
            Constraints constraints(mesh.nodes.size());
            constraints.prescribe(grid_nodes(mesh, [](const Vector3& x) { return x.z() < 0.03; }),
                                  Vector3::Zero());
            body.set_constraints(constraints);
            body.set_external_force(gravity_load(mesh, materials, Vector3(9.81, 0, 0)));
            const StepReport report =
                body.solve(0, {.max_newton = 1, .tolerance = 1e-7, .linear_tolerance = 1e-8});
            EXPECT_TRUE(report.converged) << report.reason;
            EXPECT_LE(report.iterations, most)
                << mesh.hexahedra.size() << " cells, poisson " << poisson;
        }
}

/// u = sin(pi x) sin(pi y) sin(pi z) a on the unit cube, zero on its border, under the body force
/// that this takes: order 2 in displacement. (Interpolation alone would be that.)
double manufactured_error(int n) {
    const MeshHierarchy hierarchy = alone(test::hex_grid({n, n, n}, {1, 1, 1}));
    const TetMesh& mesh = hierarchy.levels.front();
    const std::vector<Material> materials{{.young_Pa = 1, .poisson = 0.3}};
    const double lambda = materials[0].lambda(), mu = materials[0].mu();
    constexpr double pi = std::numbers::pi;
    const Vector3 a(1, 2, -1);
    // f = -mu lap u - (lambda + mu) grad div u, with u = a phi: -lap phi = 3 pi^2 phi.
    const auto body_force = [&](const Vector3& x) -> Vector3 {
        Eigen::Matrix3d hessian;
        const Eigen::Array3d s = (pi * x.array()).sin(), c = (pi * x.array()).cos();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                double value = pi * pi;
                for (int d = 0; d < 3; ++d)
                    value *= i == j ? (d == i ? -s[d] : s[d]) : (d == i || d == j ? c[d] : s[d]);
                hessian(i, j) = value;
            }
        return 3 * pi * pi * mu * s.prod() * a - (lambda + mu) * hessian * a;
    };
    std::vector<Vector3> force(mesh.nodes.size(), Vector3::Zero());
    const double volume = cell_volume(mesh);
    for (const Hexahedron& cell : mesh.hexahedra)
        for (int point = 0; point < 8; ++point) {
            const Vector3 at = ElementShape<8>::place(point);
            const Vector3 f = body_force(mesh.nodes[cell[0]] + at / n) * volume / 8;
            for (int k = 0; k < 8; ++k) {
                double N = 1;
                for (int d = 0; d < 3; ++d) N *= k >> d & 1 ? at[d] : 1 - at[d];
                force[cell[k]] += N * f;
            }
        }
    DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, "linear"}, {}, {});
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(nodes_of(boundary_triangles(mesh.tets)), Vector3::Zero());
    body.set_constraints(constraints);
    body.set_external_force(force);
    EXPECT_TRUE(body.solve(0, hex_tight).converged);
    const auto u = body.displacement();
    // In L2, at the cells' middles, where the answer is no node's.
    double sum = 0;
    for (const Hexahedron& cell : mesh.hexahedra) {
        Vector3 mean = Vector3::Zero();
        for (const std::int32_t k : cell) mean += u[k] / 8;
        const Vector3 x = mesh.nodes[cell[0]] + Vector3::Constant(0.5 / n);
        sum += volume * (mean - (pi * x.array()).sin().prod() * a).squaredNorm();
    }
    return std::sqrt(sum);
}

TEST(HexSolver, ConvergesWithOrderTwo) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const double coarse = manufactured_error(8), fine = manufactured_error(16);
    EXPECT_GT(std::log2(coarse / fine), 1.9) << coarse << ", " << fine;
    EXPECT_LT(fine, 0.02);
}

/// A pressed block near incompressibility: by displacements alone it locks; from the cell's mean
/// dilation its stiffness hardly changes from 0.49 to 0.4999.
TEST(HexSolver, MeanDilationDoesNotLock) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const MeshHierarchy hierarchy = alone(test::hex_grid({8, 8, 8}, {0.1, 0.1, 0.1}));
    const TetMesh& mesh = hierarchy.levels.front();
    const auto energy = [&](double poisson, Formulation form) {
        // Of one shear modulus.
        const std::vector<Material> materials{
            {.young_Pa = 2000 * (1 + poisson), .poisson = poisson}};
        DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, "linear", form}, {}, {});
        Constraints constraints(mesh.nodes.size());
        constraints.prescribe(grid_nodes(mesh, [](const Vector3& x) { return x.z() < 1e-9; }),
                              Vector3::Zero());
        constraints.prescribe(
            grid_nodes(
                mesh,
                [](const Vector3& x) { return x.z() > 0.0999 && x.x() < 0.051 && x.y() < 0.051; }),
            Vector3(0, 0, -0.01));
        body.set_constraints(constraints);
        EXPECT_TRUE(body.solve(0, {.linear_tolerance = 1e-8}).converged) << poisson;
        return body.strain_energy();
    };
    const double at_49 = energy(0.49, Formulation::mixed),
                 nearer = energy(0.4999, Formulation::mixed);
    EXPECT_LT(nearer / at_49, 1.1);
    EXPECT_GT(energy(0.4999, Formulation::displacement) / nearer, 1.5);
}

/// Holds a cube at its foot, and presses half of its top by so many metres.
Constraints pressed_cube(const TetMesh& mesh, double press) {
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(grid_nodes(mesh, [](const Vector3& x) { return x.z() < 1e-9; }),
                          Vector3::Zero());
    constraints.prescribe(
        grid_nodes(mesh, [](const Vector3& x) { return x.z() > 0.0999 && x.x() < 0.051; }),
        Vector3(0, 0, -press));
    return constraints;
}

/// With pressures eliminated in Newton's method too, corotated took 14 iterations, and neo-Hookean
/// did not converge in 50.
TEST(HexSolver, TakesFewNewtonIterationsNearlyIncompressible) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const MeshHierarchy hierarchy = alone(test::hex_grid({10, 10, 10}, {0.1, 0.1, 0.1}));
    for (const char* model : {"corotated", "neohookean"}) {
        const std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.4999}};
        DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, model, Formulation::mixed},
                            {}, {});
        body.set_constraints(pressed_cube(hierarchy.levels.front(), 0.01));
        const StepReport report = body.solve(0, {});
        EXPECT_TRUE(report.converged) << model << ": " << report.reason;
        EXPECT_LE(report.newton_iterations, 8) << model;
        EXPECT_LE(report.iterations, 600) << model;
    }
}

/// PETSc's own line searches, which do not know of pressures, reach the same equilibrium.
TEST(HexSolver, TakesSearchesOfPetscNearlyIncompressible) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const MeshHierarchy hierarchy = alone(test::hex_grid({4, 4, 4}, {0.1, 0.1, 0.1}));
    const std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.49}};
    const auto energy = [&] {
        DeformableBody body({PETSC_COMM_SELF, hierarchy},
                            {materials, "neohookean", Formulation::mixed}, {}, {});
        body.set_constraints(pressed_cube(hierarchy.levels.front(), 0.002));
        const StepReport report = body.solve(0, {});
        EXPECT_TRUE(report.converged) << report.reason;
        return body.strain_energy();
    };
    const double ours = energy();
    const test::PetscOptions options({std::pair{"-snes_linesearch_type", "bt"}});
    EXPECT_NEAR(energy(), ours, 1e-6 * ours);
}

/// Green's model from crumpled starts, in some of which Newton's method with pressures goes astray.
TEST(HexSolver, BeginsAnewWherePressuresDoNotServe) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const MeshHierarchy hierarchy = alone(test::hex_grid({4, 4, 4}, {0.1, 0.1, 0.1}));
    const TetMesh& mesh = hierarchy.levels.front();
    const std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.49}};
    int solved_anew = 0;
    for (const unsigned seed : {1, 2, 3, 4, 5})
        for (const double size : {0.01, 0.02}) {
            DeformableBody body({PETSC_COMM_SELF, hierarchy},
                                {materials, "green", Formulation::mixed}, {}, {});
            body.set_constraints(pressed_cube(mesh, 0));
            body.set_displacement(test::rough_values(mesh.nodes.size(), size, seed));
            const StepReport report = body.solve(0, {});
            if (report.converged && report.newton_iterations > CellPressures::max_iterations)
                ++solved_anew;
        }
    EXPECT_GT(solved_anew, 0);
}

TEST(HexSolver, RefusesOtherSolvers) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const MeshHierarchy hierarchy = alone(test::hex_grid({2, 2, 2}, {0.1, 0.1, 0.1}));
    const std::vector<Material> materials{{}};
    for (const SolverKind kind : {SolverKind::direct, SolverKind::gamg})
        EXPECT_THROW(
            DeformableBody({PETSC_COMM_SELF, hierarchy}, {materials, "linear"}, {}, {.kind = kind}),
            Error);
}

}  // namespace
}  // namespace livetet
