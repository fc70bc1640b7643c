// Newton's method by SNES: its options are real, and whatever they choose leads to the same answer.

#include "solvers/nonlinear/newton_solver.hpp"

#include <gtest/gtest.h>

#include <map>

#include "base/error.hpp"
#include "mesh/quadratic.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "support/hex_grids.hpp"
#include "support/petsc_options.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A neo-Hookean beam on one rank, clamped at one end and pulled down by its weight, about a
/// quarter of its length.
class NewtonSolverTest : public testing::Test {
  protected:
    struct Outcome {
        StepReport report;
        std::vector<Vector3> u;
    };
    Outcome solve(const SolveControls& controls,
                  std::vector<std::pair<std::string, std::string>> options = {}) const {
        const test::PetscOptions set(std::move(options));
        DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, "neohookean"}, {},
                            {.kind = SolverKind::direct});
        const TetMesh& mesh = hierarchy.levels.front();
        Constraints constraints(mesh.nodes.size());
        constraints.prescribe(
            test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
            Vector3::Zero());
        body.set_constraints(constraints);
        body.set_external_force(std::vector<Vector3>(
            mesh.nodes.size(), Vector3(0, 0, -0.4 / static_cast<double>(mesh.nodes.size()))));
        Outcome outcome;
        outcome.report = body.solve(0, controls);
        outcome.u = body.displacement();
        return outcome;
    }
    static double largest(const std::vector<Vector3>& u) {
        double size = 0;
        for (const Vector3& v : u) size = std::max(size, v.norm());
        return size;
    }
    static double gap(const Outcome& a, const Outcome& b) {
        double size = 0;
        for (std::size_t n = 0; n < a.u.size(); ++n)
            size = std::max(size, (a.u[n] - b.u[n]).norm());
        return size;
    }

    const SolveControls tight{.max_newton = 60, .tolerance = 1e-9, .linear_tolerance = 1e-8};
    const std::vector<Material> materials{{.young_Pa = 20000, .poisson = 0.4}};
    const MeshHierarchy hierarchy =
        make_hierarchy({test::block({8, 3, 3}, Vector3(0.2, 0.05, 0.05))}, "a beam");
};

TEST_F(NewtonSolverTest, ConvergesQuadraticallyNearTheSolution) {
    const Outcome loose = solve({.max_newton = 60, .tolerance = 1e-3, .linear_tolerance = 1e-10});
    const Outcome close = solve({.max_newton = 60, .tolerance = 1e-12, .linear_tolerance = 1e-10});
    ASSERT_TRUE(loose.report.converged && close.report.converged);
    EXPECT_GT(largest(close.u), 0.02);  // it does bend
    EXPECT_LE(close.report.newton_iterations, loose.report.newton_iterations + 3);
    EXPECT_LT(close.report.imbalance, 1e-12);
}

TEST_F(NewtonSolverTest, ShowsItsIterationsAndWhatItHadToMeet) {
    std::vector<NewtonProgress> seen;
    SolveControls watched = tight;
    watched.observe = [&](const NewtonProgress& p) { seen.push_back(p); };
    const StepReport report = solve(watched).report;
    ASSERT_TRUE(report.converged);
    ASSERT_GE(seen.size(), static_cast<std::size_t>(report.newton_iterations));
    EXPECT_EQ(seen.back().newton_iterations, report.newton_iterations - 1);
    EXPECT_LT(seen.back().imbalance, seen.front().imbalance);
    EXPECT_LT(seen.back().linear_residual, 1e-6);
    EXPECT_NEAR(report.allowed_imbalance, tight.tolerance, 1e-3 * tight.tolerance);
    EXPECT_LE(report.imbalance, report.allowed_imbalance);
}

/// 0.5 of what is allowed, in both directions from the tolerance that was asked for.
TEST_F(NewtonSolverTest, ALinearSolveThatCanEndTheStepGoesAsFarAsThat) {
    if (test::rank_count() > 1) GTEST_SKIP() << "each rank would do the same";
    const MeshHierarchy levels = make_hierarchy(
        {test::block({12, 6, 6}, test::beam_size), test::block({6, 3, 3}, test::beam_size)},
        "a beam of two levels");
    const TetMesh& mesh = levels.levels.front();
    DeformableBody body({PETSC_COMM_SELF, levels}, {materials}, {},
                        {.kind = SolverKind::multigrid});
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                          Vector3::Zero());
    body.set_constraints(constraints);
    body.set_external_force(std::vector<Vector3>(
        mesh.nodes.size(), Vector3(0, 0, -5 / static_cast<double>(mesh.nodes.size()))));
    int looser = 0, tighter = 0;
    for (const double tolerance : {1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8, 1e-8}) {
        std::map<int, std::vector<NewtonProgress>> seen;  // by Newton iteration
        SolveControls controls{.tolerance = tolerance, .linear_tolerance = 1e-3};
        controls.observe = [&](const NewtonProgress& p) { seen[p.newton_iterations].push_back(p); };
        body.set_displacement(std::vector<Vector3>(mesh.nodes.size(), Vector3::Zero()));
        ASSERT_TRUE(body.solve(0, controls).converged);
        for (const auto& [newton, linear] : seen) {
            const double last = 0.5 * tolerance / linear.back().imbalance,
                         aim = last < 1e-4 ? 1e-3 : std::min(last, 0.1);
            looser += aim > 1e-3, tighter += aim < 1e-3;
            EXPECT_LE(linear.back().linear_residual, aim * (1 + 1e-9)) << tolerance << newton;
            if (linear.size() > 1) {
                EXPECT_GT(linear[linear.size() - 2].linear_residual, aim) << tolerance << newton;
            }
        }
    }
    EXPECT_GT(looser, 0);
    EXPECT_GT(tighter, 0);
}

TEST_F(NewtonSolverTest, OtherSearchesAndTrustRegionsReachTheSameEquilibrium) {
    const Outcome ours = solve(tight);
    ASSERT_TRUE(ours.report.converged);
    using Options = std::vector<std::pair<std::string, std::string>>;
    for (const Options& options :
         {Options{{"-snes_linesearch_type", "bt"}}, Options{{"-snes_linesearch_type", "cp"}},
          Options{{"-snes_linesearch_type", "l2"}}, Options{{"-snes_type", "newtontr"}}}) {
        // A trust region by the residual's norm takes small steps where a beam bends.
        SolveControls patient = tight;
        patient.max_newton = 400;
        const Outcome other = solve(patient, options);
        EXPECT_TRUE(other.report.converged)
            << options.front().second << ": " << other.report.reason;
        EXPECT_LT(gap(ours, other), 1e-6 * largest(ours.u)) << options.front().second;
    }
}

TEST_F(NewtonSolverTest, OptionsGoBeforeWhatASolveAsksFor) {
    const Outcome two = solve(tight, {{"-snes_max_it", "2"}});
    EXPECT_FALSE(two.report.converged);
    EXPECT_EQ(two.report.newton_iterations, 2);
    EXPECT_STREQ(two.report.reason, "DIVERGED_MAX_IT");
    const Outcome rough = solve(tight, {{"-snes_rtol", "1e-2"}});
    EXPECT_TRUE(rough.report.converged);
    EXPECT_LT(rough.report.newton_iterations, solve(tight).report.newton_iterations);
    EXPECT_GT(rough.report.imbalance, 1e-9);
}

/// Any other solver is refused for a grid.
SolverKind exact_kind(const TetMesh& mesh) {
    return mesh.hexahedra.empty() ? SolverKind::direct : SolverKind::automatic;
}

/// A cantilever that is bent and then let go: Newton iterations of 20 damped steps.
int newton_iterations_of_release(const MeshHierarchy& hierarchy, const ModelChoice& model,
                                 Formulation formulation, double beta) {
    const std::vector<Material> materials{
        {.young_Pa = 20000, .poisson = 0.4, .density_kg_per_m3 = 1000}};
    DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, model, formulation},
                        {.scheme = TimeScheme::newmark, .rayleigh_beta = beta},
                        {.kind = exact_kind(hierarchy.levels.front())});
    const TetMesh& mesh = hierarchy.levels.front();
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                          Vector3::Zero());
    body.set_constraints(constraints);
    std::vector<Vector3> velocity;
    for (const Vector3& x : mesh.nodes) velocity.push_back({0, 0, 100 * x.x() * x.x()});
    body.set_velocity(velocity);
    int newton_iterations = 0;
    for (int step = 0; step < 20; ++step) {
        const StepReport report =
            body.solve(0.01, {.max_newton = 50, .tolerance = 1e-10, .linear_tolerance = 1e-9});
        EXPECT_TRUE(report.converged) << model.name() << ", step " << step << ": " << report.reason;
        newton_iterations += report.newton_iterations;
    }
    return newton_iterations;
}

/// Damping by the stiffness adds no term to the residual whose derivative the tangent lacks.
TEST(DampedSteps, TakeNoMoreNewtonIterationsThanUndampedOnes) {
    if (test::rank_count() > 1) GTEST_SKIP() << "each rank would do the same";
    const MeshHierarchy linear =
        make_hierarchy({test::block({8, 2, 2}, Vector3(0.2, 0.05, 0.05))}, "a beam");
    const MeshHierarchy quadratic = with_quadratic_level(linear);
    const MeshHierarchy grid =
        make_hierarchy({test::hex_grid({8, 2, 2}, Vector3(0.2, 0.05, 0.05))}, "a grid");
    for (const char* model : {"corotated", "neohookean", "mooney_rivlin", "holzapfel_gasser_ogden"})
        for (const Formulation form : {Formulation::displacement, Formulation::mixed})
            for (const MeshHierarchy* mesh : {&linear, &quadratic, &grid}) {
                if (mesh == &quadratic && form == Formulation::mixed) continue;  // slow, no news
                const int damped = newton_iterations_of_release(*mesh, model, form, 0.02);
                const int free = newton_iterations_of_release(*mesh, model, form, 0);
                EXPECT_LE(damped, free + 10) << model << ", " << static_cast<int>(form);
                EXPECT_GT(free, 60);  // it moves far enough to need some
            }
}

/// What holds a beam is what its momentum and its damping ask for: reactions are of the same
/// damping as the step that was solved.
TEST(DampedSteps, ReactionsAreTheRateOfMomentum) {
    const Vector3 size(0.2, 0.05, 0.05);
    const MeshHierarchy tets = make_hierarchy({test::block({6, 2, 2}, size)}, "a beam"),
                        grid = make_hierarchy({test::hex_grid({6, 2, 2}, size)}, "a grid");
    const std::vector<Material> materials{
        {.young_Pa = 20000, .poisson = 0.4, .density_kg_per_m3 = 1000}};
    for (const MeshHierarchy* hierarchy : {&tets, &grid})
        for (const char* model : {"linear", "corotated", "neohookean"}) {
            const TetMesh& mesh = hierarchy->levels.front();
            DeformableBody body(
                {PETSC_COMM_SELF, *hierarchy}, {materials, model, Formulation::displacement},
                {.scheme = TimeScheme::newmark, .rayleigh_beta = 0.02}, {.kind = exact_kind(mesh)});
            Constraints constraints(mesh.nodes.size());
            constraints.prescribe(
                test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                Vector3::Zero());
            body.set_constraints(constraints);
            std::vector<Vector3> velocity;
            for (const Vector3& x : mesh.nodes) velocity.push_back({0, 0, 100 * x.x() * x.x()});
            body.set_velocity(velocity);
            double gap = 0, largest = 0;
            for (int step = 0; step < 10; ++step) {
                (void)body.solve(0.01,
                                 {.max_newton = 50, .tolerance = 1e-11, .linear_tolerance = 1e-10});
                const std::vector<Vector3> reactions = body.reactions();
                const BodySnapshot state = body.gather_state();
                const auto mass = body.node_mass();
                Vector3 held = Vector3::Zero(), inertia = Vector3::Zero();
                for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
                    held += reactions[n];
                    inertia += mass[n] * Eigen::Map<const Vector3>(&state.nodal[2][3 * n]);
                }
                gap = std::max(gap, (held - inertia).norm());
                largest = std::max(largest, inertia.norm());
            }
            EXPECT_GT(largest, 0.1) << model;
            EXPECT_LT(gap, 1e-8 * largest) << model;
        }
}

/// Eisenstat and Walker's forcing terms solve the first linear systems less tightly.
TEST_F(NewtonSolverTest, EisenstatWalkerSavesLinearIterations) {
    const std::pair<std::string, std::string> jacobi[] = {{"-pc_type", "pbjacobi"},
                                                          {"-ksp_max_it", "2000"}};
    const Outcome plain = solve(tight, {jacobi[0], jacobi[1]});
    const Outcome forced = solve(tight, {jacobi[0], jacobi[1], {"-snes_ksp_ew", ""}});
    ASSERT_TRUE(plain.report.converged && forced.report.converged) << forced.report.reason;
    EXPECT_LT(forced.report.iterations, 0.97 * plain.report.iterations)
        << "a tenth or more, by the round-off of the BLAS at hand";
    EXPECT_LT(gap(plain, forced), 1e-6 * largest(plain.u));
}

/// What a callback throws reaches the caller with its own type and text.
TEST(PetscCallback, ThrowsOnWhatWasThrownInside) {
    PetscHandle<KSP> ksp;
    PetscHandle<Mat> shell;
    PetscHandle<Vec> b, x;
    LIVETET_PETSC(MatCreateShell(PETSC_COMM_SELF, 4, 4, 4, 4, nullptr, shell.out()));
    const auto multiply = [](Mat, Vec, Vec) noexcept -> PetscErrorCode {
        return in_callback([] { fail("region 7: its fibres are not finite"); });
    };
    LIVETET_PETSC(MatShellSetOperation(
        shell.get(), MATOP_MULT,
        reinterpret_cast<void (*)()>(static_cast<PetscErrorCode (*)(Mat, Vec, Vec)>(multiply))));
    LIVETET_PETSC(MatCreateVecs(shell.get(), x.out(), b.out()));
    LIVETET_PETSC(VecSet(b.get(), 1));
    LIVETET_PETSC(KSPCreate(PETSC_COMM_SELF, ksp.out()));
    LIVETET_PETSC(KSPSetOperators(ksp.get(), shell.get(), shell.get()));
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp.get(), &pc));
    LIVETET_PETSC(PCSetType(pc, PCNONE));
    try {
        LIVETET_PETSC(KSPSolve(ksp.get(), b.get(), x.get()));
        FAIL() << "nothing was thrown";
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(), "region 7: its fibres are not finite");
    }
    EXPECT_EQ(kept_exception(), nullptr);
}

}  // namespace
}  // namespace livetet
