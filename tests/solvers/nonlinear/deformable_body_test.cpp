#include "solvers/nonlinear/deformable_body.hpp"

#include <gtest/gtest.h>

#include "mesh/quadratic.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

using test::block;
using test::nodes_where;

const std::vector<Material> soft{{.young_Pa = 5000, .poisson = 0.4, .density_kg_per_m3 = 1000}};

MeshHierarchy beam(int levels) {
    std::vector<TetMesh> meshes;
    const std::array<int, 3> cells[] = {{12, 6, 6}, {7, 4, 4}, {4, 2, 2}};
    for (int l = 0; l < levels; ++l) meshes.push_back(block(cells[l], test::beam_size));
    return make_hierarchy(std::move(meshes), "a block");
}

std::vector<std::vector<std::int32_t>> partitions(const MeshHierarchy& hierarchy) {
    const int ranks = test::rank_count();
    std::vector<std::vector<std::int32_t>> parts;
    for (const TetMesh& level : hierarchy.levels)
        parts.push_back(partition_tets(level.tets, ranks));
    return parts;
}

struct Case {
    MeshHierarchy hierarchy;
    std::vector<std::vector<std::int32_t>> parts;
    test::WholeBody body;
    Case(int levels, const ModelChoice& strain, const TimeOptions& time,
         const SolverOptions& options)
        : hierarchy(beam(levels)),
          parts(partitions(hierarchy)),
          body({PETSC_COMM_WORLD, hierarchy, parts}, {soft, strain}, time, options) {}
    const TetMesh& mesh() const { return hierarchy.levels.front(); }
};

const SolveControls to_equilibrium{.max_newton = 60, .tolerance = 1e-10, .linear_tolerance = 1e-6};

Constraints pressed(const TetMesh& mesh, const Vector3& press) {
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                          Vector3::Zero());
    constraints.prescribe(nodes_where(mesh,
                                      [](const Vector3& x) {
                                          return x.z() > 0.0999 && std::abs(x.x() - 0.1) < 0.02 &&
                                                 std::abs(x.y() - 0.05) < 0.02;
                                      }),
                          press);
    return constraints;
}

double largest_difference(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
    return largest;
}

std::vector<Vector3> pressed_with(SolverOptions options, int levels, int* iterations = nullptr) {
    Case c(levels, "corotated", {}, options);
    c.body.set_constraints(pressed(c.mesh(), {0, 0.003, -0.012}));
    const StepReport report = c.body.solve(0, to_equilibrium);
    EXPECT_TRUE(report.converged) << report.imbalance;
    if (iterations) *iterations = report.iterations / std::max(1, report.newton_iterations);
    return c.body.displacement();
}

TEST(DeformableBody, PatchTestALinearFieldOnTheBoundaryFillsTheInside) {
    for (const char* strain : {"linear", "corotated"}) {
        Case c(1, strain, {}, {.kind = SolverKind::direct});
        Eigen::Matrix3d A;
        A << 0.01, 0.02, 0, -0.01, 0.02, 0.01, 0, 0.01, -0.02;
        Constraints constraints(c.mesh().nodes.size());
        for (const std::int32_t n : nodes_of(boundary_triangles(c.mesh().tets)))
            constraints.prescribe(std::array{n}, A * c.mesh().nodes[n]);
        c.body.set_constraints(constraints);
        EXPECT_TRUE(
            c.body.solve(0, {.max_newton = 40, .tolerance = 1e-13, .linear_tolerance = 1e-12})
                .converged);
        const auto u = c.body.displacement();
        for (std::size_t n = 0; n < u.size(); ++n)
            EXPECT_LT((u[n] - A * c.mesh().nodes[n]).norm(), 1e-12);
    }
}

TEST(DeformableBody, ABarUnderItsWeightStretchesAsTheClosedForm) {
    // Hanging bar, nu = 0, linear: u(L) = rho g L^2 / (2 E).
    const std::vector<Material> cork{{.young_Pa = 1e5, .poisson = 0, .density_kg_per_m3 = 1000}};
    const MeshHierarchy hierarchy = beam(1);
    const TetMesh& mesh = hierarchy.levels.front();
    const auto parts = partitions(hierarchy);
    test::WholeBody body({PETSC_COMM_WORLD, hierarchy, parts}, {cork, "linear"}, {},
                         {.kind = SolverKind::direct});
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                          Vector3::Zero());
    constraints.prescribe(nodes_where(mesh, [](const Vector3&) { return true; }), Vector3::Zero(),
                          6);  // slide along x only
    body.set_constraints(constraints);
    std::vector<Vector3> weight(mesh.nodes.size(), Vector3::Zero());
    for (const Tet& t : mesh.tets)
        for (const std::int32_t n : t) weight[n].x() += 1000 * 9.81 * signed_volume(mesh, t) / 4;
    body.set_external_force(weight);
    EXPECT_TRUE(
        body.solve(0, {.max_newton = 2, .tolerance = 1e-10, .linear_tolerance = 1e-12}).converged);
    const auto u = body.displacement();
    const double expected = 1000 * 9.81 * 0.2 * 0.2 / (2 * 1e5);
    const auto end = nodes_where(mesh, [](const Vector3& x) { return x.x() > 0.1999; });
    double mean = 0;
    for (const std::int32_t n : end) mean += u[n].x() / static_cast<double>(end.size());
    EXPECT_NEAR(mean, expected, 3e-3 * expected);
    // The wall carries the whole weight.
    double reaction = 0;
    const auto force = body.elastic_force();
    for (const std::int32_t n : nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }))
        reaction += force[n].x() - weight[n].x();
    EXPECT_NEAR(reaction, -1000 * 9.81 * 0.2 * 0.1 * 0.1, 1e-6);
}

/// The operator, in each layout, tangent and strain model, against differences of the forces.
TEST(LevelAssembler, TheMatrixIsTheDerivativeOfTheForce) {
    const MeshHierarchy linear = make_hierarchy({block({3, 2, 2}, test::beam_size)}, "a block");
    const MeshHierarchy quadratic = with_quadratic_level(linear);
    const auto parts = partitions(linear).front();
    for (const bool is_quadratic : {false, true})
        for (const MatrixLayout layout : {MatrixLayout::blocks, MatrixLayout::scalars})
            for (const char* strain : {"linear", "corotated", "green", "neohookean"}) {
                const TetMesh& mesh = (is_quadratic ? quadratic : linear).levels.front();
                LevelAssembler level(distribute_mesh(PETSC_COMM_WORLD, mesh, parts), soft, strain,
                                     Formulation::displacement, layout);
                level.find_mass();
                const auto u = make_vector(level.share()), v = make_vector(level.share()),
                           product = make_vector(level.share()), force = make_vector(level.share()),
                           back = make_vector(level.share());
                std::vector<Vector3> twist, wave;
                for (const Vector3& x : mesh.nodes) {
                    twist.push_back({0.1 * x.y() * x.x(), -x.z() * x.x() * 4, x.y() * x.x() * 4});
                    wave.push_back(
                        {std::sin(40 * x.x()), std::cos(30 * x.y()), std::sin(50 * x.z() + x.x())});
                }
                test::fill(level.share(), twist, u.get());
                test::fill(level.share(), wave, v.get());
                update_ghosts(u.get());
                update_ghosts(v.get());
                ElementRotations rotations = level.make_rotations();
                level.update_rotations(u.get(), rotations);
                for (int renewed = 0; renewed < 2; ++renewed) {
                    level.assemble(
                        {.u = u.get(), .rotations = &rotations},
                        {.stiffness = 0.5 + renewed, .mass = 3, .tangent = Tangent::exact});
                    LIVETET_PETSC(MatMult(level.matrix(), v.get(), product.get()));
                }
                const double h = 1e-6;
                const auto force_at = [&](double t, Vec f) {
                    LIVETET_PETSC(VecAXPY(u.get(), t, v.get()));
                    update_ghosts(u.get());
                    level.update_rotations(u.get(), rotations);
                    level.elastic_force({.u = u.get(), .rotations = &rotations}, f);
                    LIVETET_PETSC(VecAXPY(u.get(), -t, v.get()));
                };
                force_at(h, force.get());
                force_at(-h, back.get());
                {
                    const ReadArray values(v.get()), got(product.get()), f(force.get()),
                        b(back.get());
                    for (std::size_t i = 0; i < got.span().size(); ++i)
                        ASSERT_NEAR(got[i],
                                    1.5 * (f[i] - b[i]) / (2 * h) +
                                        3.0 * level.node_mass()[i / 3] * values[i],
                                    2e-4)
                            << i << " strain " << strain;
                }
                // With the rotation held: what damping and moved constraints are made of.
                update_ghosts(u.get());
                level.update_rotations(u.get(), rotations);
                if (std::string_view(strain) != "corotated") continue;
                level.assemble({.u = u.get(), .rotations = &rotations}, {.stiffness = 2});
                LIVETET_PETSC(MatMult(level.matrix(), v.get(), product.get()));
                LIVETET_PETSC(VecSet(force.get(), 0));
                level.add_stiffness_times(2, {.u = u.get(), .rotations = &rotations}, v.get(),
                                          force.get());
                const ReadArray got(product.get()), expected(force.get());
                for (std::size_t i = 0; i < got.span().size(); ++i)
                    ASSERT_NEAR(got[i], expected[i], 1e-9) << i;
            }
}

TEST(DeformableBody, EverySolverGivesTheSameAnswer) {
    const auto reference = pressed_with({.kind = SolverKind::direct}, 1);
    int iterations = 0;
    EXPECT_LT(largest_difference(pressed_with({.kind = SolverKind::multigrid,
                                               .coarse = CoarseOperator::rediscretised},
                                              3, &iterations),
                                 reference),
              1e-9);
    EXPECT_LE(iterations, 20);
    EXPECT_LT(largest_difference(
                  pressed_with({.kind = SolverKind::multigrid, .coarse = CoarseOperator::galerkin},
                               3, &iterations),
                  reference),
              1e-9);
    EXPECT_LE(iterations, 14);
    const int ranks = test::rank_count();
    if (ranks == 1) {
        // Forces in float; how near it comes when it is let go on is
        // LiveSolverTest.AgreesWithThePlainPath's to say.
        EXPECT_LT(
            largest_difference(pressed_with({.kind = SolverKind::live}, 3, &iterations), reference),
            1e-7);
        EXPECT_LE(iterations, 20);
    }
    EXPECT_LT(largest_difference(pressed_with({.kind = SolverKind::boomeramg}, 1), reference),
              5e-9);
    EXPECT_LT(largest_difference(pressed_with({.kind = SolverKind::gamg}, 1), reference), 5e-9);
}

TEST(DeformableBody, OneRankAndManyAgree) {
    const auto many = pressed_with({.kind = SolverKind::multigrid}, 3);
    const MeshHierarchy hierarchy = beam(3);
    test::WholeBody alone({PETSC_COMM_SELF, hierarchy}, {soft, "corotated"}, {},
                          {.kind = SolverKind::multigrid});
    alone.set_constraints(pressed(hierarchy.levels.front(), {0, 0.003, -0.012}));
    ASSERT_TRUE(alone.solve(0, to_equilibrium).converged);
    EXPECT_LT(largest_difference(many, alone.displacement()), 1e-8 * 0.012);
}

/// Small meshes are on fewer ranks than there are: the others make the same collective calls.
TEST(DeformableBody, RanksWithoutTetsTakePart) {
    if (test::rank_count() == 1) GTEST_SKIP() << "the only rank has all tets";
    const MeshHierarchy hierarchy = with_quadratic_level(make_hierarchy(
        {block({8, 4, 4}, test::beam_size), block({4, 2, 2}, test::beam_size)}, "a small block"));
    std::vector<std::vector<std::int32_t>> on_the_first;
    for (const TetMesh& level : hierarchy.levels) on_the_first.emplace_back(level.tets.size(), 0);
    for (const SolverKind kind : {SolverKind::multigrid, SolverKind::gamg}) {
        test::WholeBody many({PETSC_COMM_WORLD, hierarchy, on_the_first}, {soft, "corotated"}, {},
                             {.kind = kind});
        test::WholeBody alone({PETSC_COMM_SELF, hierarchy}, {soft, "corotated"}, {},
                              {.kind = kind});
        for (test::WholeBody* body : {&many, &alone}) {
            body->set_constraints(pressed(hierarchy.levels.front(), {0, 0.003, -0.012}));
            ASSERT_TRUE(body->solve(0, to_equilibrium).converged);
        }
        EXPECT_LT(largest_difference(many.displacement(), alone.displacement()), 1e-8 * 0.012);
    }
}

TEST(DeformableBody, OneRankAndManyAgreeWithPressuresAndTenNodes) {
    const std::vector<Material> silicone{
        {.young_Pa = 5000, .poisson = 0.499, .density_kg_per_m3 = 1000}};
    for (const bool quadratic : {false, true})
        for (const char* strain : {"corotated", "neohookean"}) {
            MeshHierarchy hierarchy = beam(3);
            if (quadratic) hierarchy = with_quadratic_level(std::move(hierarchy));
            const auto parts = partitions(hierarchy);
            const ElasticModel model{silicone, strain, Formulation::mixed};
            const Constraints press = pressed(hierarchy.levels.front(), {0, 0.002, -0.006});
            test::WholeBody many({PETSC_COMM_WORLD, hierarchy, parts}, model, {},
                                 {.kind = SolverKind::multigrid});
            test::WholeBody alone({PETSC_COMM_SELF, hierarchy}, model, {},
                                  {.kind = SolverKind::multigrid});
            for (test::WholeBody* body : {&many, &alone}) {
                body->set_constraints(press);
                const StepReport report = body->solve(0, to_equilibrium);
                ASSERT_TRUE(report.converged) << report.imbalance;
            }
            EXPECT_LT(largest_difference(many.displacement(), alone.displacement()), 1e-7 * 0.006);
        }
}

TEST(DeformableBody, ComesHomeAfterARimOfElementsWasInverted) {
    Case c(3, "corotated", {}, {.kind = SolverKind::multigrid});
    for (const double depth : {0.01, 0.02, 0.03, 0.04, 0.05, 0.03, 0.0}) {
        c.body.set_constraints(pressed(c.mesh(), {0, 0, -depth}));
        (void)c.body.solve(0, to_equilibrium);
    }
    EXPECT_LT(largest_difference(c.body.displacement(),
                                 std::vector<Vector3>(c.mesh().nodes.size(), Vector3::Zero())),
              1e-8);
}

TEST(DeformableBody, NewConstraintsAndCoefficientsReachThePreconditioner) {
    // A stale block-Jacobi or factorisation would still converge, but slower: the count must be
    // that of a new body.
    Case used(3, "corotated", {.scheme = TimeScheme::implicit_euler},
              {.kind = SolverKind::multigrid});
    used.body.set_constraints(pressed(used.mesh(), {0, 0, -1e-6}));
    (void)used.body.advance(1e-4, {.newton_iterations = 1, .linear_tolerance = 1e-8});
    const StepReport after =
        used.body.advance(1e3, {.newton_iterations = 1, .linear_tolerance = 1e-8});
    Case fresh(3, "corotated", {.scheme = TimeScheme::implicit_euler},
               {.kind = SolverKind::multigrid});
    fresh.body.set_constraints(pressed(fresh.mesh(), {0, 0, -1e-6}));
    const StepReport anew =
        fresh.body.advance(1e3, {.newton_iterations = 1, .linear_tolerance = 1e-8});
    EXPECT_TRUE(after.converged && anew.converged);
    EXPECT_NEAR(after.iterations, anew.iterations, 2);
}

TEST(DeformableBody, NewmarkKeepsTheEnergyOfASwingingBeamAndEulerLosesIt) {
    if (test::rank_count() > 2) GTEST_SKIP() << "slow; more ranks tell nothing new";
    for (const TimeScheme scheme : {TimeScheme::newmark, TimeScheme::implicit_euler}) {
        Case c(3, "corotated", {.scheme = scheme}, {.kind = SolverKind::multigrid});
        Constraints constraints(c.mesh().nodes.size());
        constraints.prescribe(nodes_where(c.mesh(), [](const Vector3& x) { return x.x() < 1e-9; }),
                              Vector3::Zero());
        c.body.set_constraints(constraints);
        std::vector<Vector3> velocity;
        for (const Vector3& x : c.mesh().nodes) velocity.push_back({0, 0, 0.5 * x.x() / 0.2});
        c.body.set_velocity(velocity);
        const double before = c.body.kinetic_energy();
        for (int step = 0; step < 40; ++step)
            (void)c.body.solve(0.01,
                               {.max_newton = 20, .tolerance = 1e-9, .linear_tolerance = 1e-6});
        const double after = c.body.kinetic_energy() + c.body.strain_energy();
        if (scheme == TimeScheme::newmark) {
            EXPECT_NEAR(after / before, 1, 0.02);
        } else {
            EXPECT_LT(after / before, 0.9);
        }
    }
}

TEST(DeformableBody, AnAxialBarSwingsAtItsClosedFormFrequency) {
    // nu = 0, clamped-free, first axial mode: f = sqrt(E / rho) / (4 L), exact in 3-D.
    const std::vector<Material> cork{{.young_Pa = 1e5, .poisson = 0, .density_kg_per_m3 = 1000}};
    const MeshHierarchy hierarchy = make_hierarchy({block({24, 2, 2}, test::beam_size)}, "bar");
    const TetMesh& mesh = hierarchy.levels.front();
    const auto parts = partitions(hierarchy);
    test::WholeBody body({PETSC_COMM_WORLD, hierarchy, parts}, {cork, "linear"},
                         {.scheme = TimeScheme::newmark}, {.kind = SolverKind::direct});
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                          Vector3::Zero());
    body.set_constraints(constraints);
    std::vector<Vector3> velocity;
    for (const Vector3& x : mesh.nodes)
        velocity.push_back({1e-3 * std::sin(M_PI * x.x() / (2 * test::beam_size.x())), 0, 0});
    body.set_velocity(velocity);
    const double period = 4 * test::beam_size.x() / std::sqrt(1e5 / 1000.0), dt = period / 200;
    // A quarter period after the start the tip turns back; half a period after, it is back where it
    // began.
    const std::int32_t tip =
        nodes_where(mesh, [](const Vector3& x) { return x.x() > 0.1999; }).front();
    double before = 0, crossing = 0;
    for (int step = 1; step <= 140 && crossing == 0; ++step) {
        (void)body.advance(dt, {.newton_iterations = 1, .linear_tolerance = 1e-10});
        const double now = body.displacement()[tip].x();
        if (step > 5 && before > 0 && now <= 0)
            crossing = (step - 1 + before / (before - now)) * dt;
        before = now;
    }
    EXPECT_NEAR(crossing / (period / 2), 1, 0.005);
}

TEST(DeformableBody, KeepsTheOldStateWhenASolveGoesWrong) {
    Case c(3, "corotated", {}, {.kind = SolverKind::multigrid});
    Constraints constraints = pressed(c.mesh(), {0, 0, -0.01});
    constraints.values.back() = Vector3::Constant(std::nan(""));
    constraints.components.back() = 7;
    c.body.set_constraints(constraints);
    EXPECT_FALSE(c.body.advance(0, {.newton_iterations = 1}).converged);
    for (const Vector3& u : c.body.displacement()) ASSERT_TRUE(u.allFinite());
}

}  // namespace
}  // namespace livetet
