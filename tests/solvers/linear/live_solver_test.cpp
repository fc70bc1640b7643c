// The live solver against the plain path, and what a deadline makes of it. On one rank: there it
// lives.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>

#include "mesh/quadratic.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "support/beam_press.hpp"
#include "support/petsc_options.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

MeshHierarchy beam() {
    return make_hierarchy(
        {test::block({16, 8, 8}, test::beam_size), test::block({8, 4, 4}, test::beam_size),
         test::block({4, 2, 2}, test::beam_size)},
        "a beam");
}

/// Two regions whose moduli are a factor of 300 apart, nearly incompressible.
const std::vector<Material> materials{
    {.young_Pa = 3000, .poisson = 0.47, .density_kg_per_m3 = 1000, .region = 0},
    {.young_Pa = 900000, .poisson = 0.3, .density_kg_per_m3 = 1000, .region = 1}};

class LiveSolverTest : public testing::Test {
  protected:
    void SetUp() override {
        const int ranks = test::rank_count();
        if (ranks > 1) GTEST_SKIP() << "the live solver is for one rank";
        for (TetMesh& level : hierarchy.levels)
            for (const Tet& t : level.tets) {
                double x = 0;
                for (const std::int32_t n : t) x += level.nodes[n].x() / 4;
                level.regions.push_back(x > 0.14);
            }
    }
    std::unique_ptr<DeformableBody> body(const SolverOptions& options,
                                         const TimeOptions& time = {}) {
        auto b = std::make_unique<DeformableBody>(
            DistributedHierarchy{PETSC_COMM_WORLD, hierarchy},
            ElasticModel{materials, model, Formulation::displacement}, time, options);
        b->set_constraints(pressed(1));
        return b;
    }
    Constraints pressed(double part) const {
        return test::pressed_beam(hierarchy.levels.front(), 0.02, part * Vector3(0, 0.004, -0.015));
    }

    /// The state and the stated error of frames that iterate, renew halves and estimate, by 1, 2
    /// and 4 threads.
    void expect_same_bits() {
        std::vector<Vector3> expected;
        std::vector<double> expected_error;
        for (const int threads : {1, 2, 4}) {
            const auto live = body({.kind = SolverKind::live, .threads = threads});
            std::vector<double> error;
            for (int k = 1; k <= 12; ++k) {
                live->set_constraints(pressed(std::min(k, 8) / 8.0));
                error.push_back(live->advance(0, {.max_iterations = 3,
                                                  .renewal = k % 2 ? RenewalExtent::half
                                                                   : RenewalExtent::whole})
                                    .linear_error);
            }
            if (threads == 1) expected = live->displacement(), expected_error = error;
            EXPECT_EQ(live->displacement(), expected) << threads << " threads";
            EXPECT_EQ(error, expected_error) << threads << " threads";
        }
    }

    MeshHierarchy hierarchy = beam();
    ModelChoice model = "corotated";
};

TEST_F(LiveSolverTest, GivesTheSameBitsOnAnyNumberOfThreads) { expect_same_bits(); }

TEST_F(LiveSolverTest, AgreesWithThePlainPathTo1e6WhenConverged) {
    const auto plain = body({.kind = SolverKind::multigrid});
    ASSERT_TRUE(plain->solve(0, {.max_newton = 60, .tolerance = 1e-10, .linear_tolerance = 1e-6})
                    .converged);
    for (const int threads : {1, 2}) {
        const auto live = body({.kind = SolverKind::live, .threads = threads});
        for (int frame = 0; frame < 60; ++frame) (void)live->advance(0, {.linear_tolerance = 1e-4});
        EXPECT_LT(test::largest_gap(live->displacement(), plain->displacement()), 1e-6 * 0.0155)
            << threads << " threads";
    }
}

/// PETSc's own iteration, which some of its options bring, is the same but for rounding.
TEST_F(LiveSolverTest, OptionsOfAnotherIterationHavePetscIterate) {
    struct Frames {
        std::vector<Vector3> u;
        double error = 0;
        int iterations = 0;
    };
    for (const char* law : {"corotated", "neohookean"}) {
        model = law;
        const auto frames = [&](std::vector<std::pair<std::string, std::string>> options) {
            const test::PetscOptions given(std::move(options));
            const auto live = body({.kind = SolverKind::live});
            StepReport last;
            for (int k = 1; k <= 2; ++k) {  // the second starts from the first
                live->set_constraints(pressed(k / 12.0));
                last = live->advance(0, {.linear_tolerance = 1e-9, .max_iterations = 2});
            }
            return Frames{live->displacement(), last.linear_error, last.iterations};
        };
        const Frames own = frames({});
        const Frames petsc = frames({{"-ksp_norm_type", "unpreconditioned"}});
        EXPECT_NE(petsc.u, own.u) << law;
        EXPECT_LT(test::largest_gap(petsc.u, own.u), 1e-3 * 0.0026) << law;
        EXPECT_NEAR(petsc.error, own.error, 1e-3 * own.error) << law;
        EXPECT_EQ(petsc.iterations, own.iterations) << law;
        // What does not change the iteration changes no bit.
        EXPECT_EQ(frames({{"-ksp_monitor_cancel", ""}}).u, own.u) << law;
    }
}

/// Laws and tets on a smaller beam; the second: ten nodes.
class LiveSolverOfLaw : public LiveSolverTest,
                        public testing::WithParamInterface<std::pair<const char*, bool>> {
  protected:
    void SetUp() override {
        hierarchy.levels.erase(hierarchy.levels.begin());
        hierarchy.transfers.erase(hierarchy.transfers.begin());
        LiveSolverTest::SetUp();
        model = GetParam().first;
        if (GetParam().second) hierarchy = with_quadratic_level(std::move(hierarchy));
    }
};

TEST_P(LiveSolverOfLaw, AgreesWithThePlainPathTo1e6WhenConverged) {
    const auto plain = body({.kind = SolverKind::multigrid});
    ASSERT_TRUE(plain->solve(0, {.max_newton = 60, .tolerance = 1e-10, .linear_tolerance = 1e-6})
                    .converged);
    for (const int threads : {1, 2}) {
        const auto live = body({.kind = SolverKind::live, .threads = threads});
        for (int k = 1; k <= 10; ++k) {  // the press sets in slowly
            live->set_constraints(pressed(k / 10.0));
            (void)live->advance(0, {.linear_tolerance = 1e-4});
        }
        for (int frame = 0; frame < 50; ++frame) (void)live->advance(0, {.linear_tolerance = 1e-4});
        EXPECT_LT(test::largest_gap(live->displacement(), plain->displacement()), 1e-6 * 0.0155)
            << threads << " threads";
    }
}

TEST_P(LiveSolverOfLaw, GivesTheSameBitsOnAnyNumberOfThreads) { expect_same_bits(); }

/// A beam shortened by two fifths wants to buckle: its tangent is not positive on the way. Frames
/// still converge, as solves go on with an operator that is.
TEST_P(LiveSolverOfLaw, GoesOnWhereTheTangentIsNotPositive) {
    const auto live = body({.kind = SolverKind::live, .threads = 2});
    for (int k = 1; k <= 40; ++k) {
        live->set_constraints(test::shortened_beam(hierarchy.levels.front(), k / 100.0));
        const StepReport report = live->advance(0, {.linear_tolerance = 1e-3});
        ASSERT_TRUE(report.converged) << k << ": " << report.reason;
        ASSERT_FALSE(report.kept_old) << k;
    }
    for (const Vector3& u : live->displacement()) ASSERT_LT(u.norm(), 0.2);
}

/// Not even with one iteration a frame does the energy rise.
TEST_P(LiveSolverOfLaw, OneIterationIsEnoughToSeeThatTheTangentIsNotPositive) {
    const auto live = body({.kind = SolverKind::live});
    for (int k = 1; k <= 40; ++k) {
        live->set_constraints(test::shortened_beam(hierarchy.levels.front(), k / 100.0));
        ASSERT_FALSE(live->advance(0, {.linear_tolerance = 1e-3, .max_iterations = 1}).kept_old);
    }
    for (int k = 0; k < 40; ++k)
        (void)live->advance(0, {.linear_tolerance = 1e-3, .max_iterations = 1});
    for (const Vector3& u : live->displacement()) ASSERT_LT(u.norm(), 0.2);
}

/// Regions of different models, one of which turns with its tets.
TEST_F(LiveSolverTest, OfSeveralModelsHasNoEnergyWhereItOnlyTurns) {
    auto mixed = materials;
    mixed[1].model = "neohookean";
    DeformableBody live(DistributedHierarchy{PETSC_COMM_WORLD, hierarchy},
                        ElasticModel{mixed, "corotated", Formulation::displacement}, {},
                        {.kind = SolverKind::live});
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.7, Vector3(1, 2, -1).normalized()) * Eigen::Matrix3d::Identity();
    std::vector<Vector3> turned;
    for (const Vector3& x : hierarchy.levels.front().nodes) turned.push_back(turn * x - x);
    live.set_displacement(turned);
    EXPECT_LT(live.strain_energy(), 1e-6);
    EXPECT_LT(live.largest_von_mises(), 1);
}

INSTANTIATE_TEST_SUITE_P(All, LiveSolverOfLaw,
                         testing::Values(std::pair("neohookean", false),
                                         std::pair("mooney_rivlin", false),
                                         std::pair("corotated", true),
                                         std::pair("neohookean", true), std::pair("linear", true)),
                         [](const auto& info) {
                             return std::string(info.param.first) +
                                    (info.param.second ? "_ten_nodes" : "_four_nodes");
                         });

TEST_F(LiveSolverTest, AgreesWithThePlainPathInTime) {
    const TimeOptions time{
        .scheme = TimeScheme::newmark, .rayleigh_alpha = 5, .rayleigh_beta = 0.01};
    const auto plain = body({.kind = SolverKind::multigrid, .relative_tolerance = 1e-9}, time);
    const auto live = body({.kind = SolverKind::live, .threads = 2}, time);
    const FrameControls effort{.newton_iterations = 8, .linear_tolerance = 1e-7};
    for (int k = 1; k <= 4; ++k)
        for (DeformableBody* b : {plain.get(), live.get()}) {
            b->set_constraints(pressed(k / 4.0));
            (void)b->advance(0.02, effort);
        }
    EXPECT_LT(test::largest_gap(live->displacement(), plain->displacement()), 3e-5 * 0.0155);
}

TEST_F(LiveSolverTest, ADeadlineThatIsPastLeavesOneIterationAndAUsableIterate) {
    const auto live = body({.kind = SolverKind::live, .threads = 2});
    const StepReport report = live->advance(
        0, {.linear_tolerance = 1e-9, .deadline = Clock::now() - std::chrono::seconds(1)});
    EXPECT_EQ(report.iterations, 1);
    EXPECT_TRUE(report.cut_short);
    EXPECT_TRUE(report.late);
    EXPECT_TRUE(report.converged);
    EXPECT_GT(report.linear_error, 0);
    for (const Vector3& u : live->displacement())
        ASSERT_TRUE(u.allFinite() && u.norm() < 0.03) << u.transpose();
}

TEST_F(LiveSolverTest, DoesTheIterationsItIsToldAndIsNearerForEachMore) {
    const auto exact = body({.kind = SolverKind::live});
    const StepReport whole = exact->advance(0, {.linear_tolerance = 1e-6});
    EXPECT_FALSE(whole.cut_short);
    EXPECT_FALSE(whole.late);
    double before = 0.0155;
    for (const int iterations : {4, 16, 32}) {
        const auto live = body({.kind = SolverKind::live});
        const StepReport report =
            live->advance(0, {.linear_tolerance = 1e-6, .max_iterations = iterations});
        EXPECT_EQ(report.iterations, iterations);
        EXPECT_TRUE(report.cut_short);
        const double gap = test::largest_gap(live->displacement(), exact->displacement());
        EXPECT_LT(gap, 0.5 * before) << iterations;
        before = gap;
    }
}

TEST_F(LiveSolverTest, GoesOnFromTheStepsBefore) {
    // A press at constant speed: each step starts from those before, which leaves little to solve.
    const auto live = body({.kind = SolverKind::live});
    double first = 0;
    StepReport report;
    for (int k = 1; k <= 6; ++k) {
        live->set_constraints(pressed(k / 60.0));
        report = live->advance(0, {.linear_tolerance = 1e-9, .max_iterations = 1});
        if (k == 1) first = report.linear_error;
    }
    EXPECT_LT(report.linear_error, 0.3 * first);
}

TEST_F(LiveSolverTest, FramesBeforeSpanAPressThatGoesRoundInAllDirections) {
    const SolverOptions options{.kind = SolverKind::live};
    const auto live = body(options), forgetful = body(options), exact = body(options);
    double error = 0, without = 0;
    for (int k = 1; k <= 36; ++k) {
        const double t = 0.05 * k;
        const Constraints now = test::pressed_beam(
            hierarchy.levels.front(), 0.02,
            {0.003 * std::sin(2 * t), 0.004 * std::sin(3 * t), -0.005 * (1 - std::cos(t))});
        for (const auto& b : {live.get(), forgetful.get(), exact.get()}) b->set_constraints(now);
        forgetful->set_state(forgetful->gather_state());  // forgets the solves before
        for (const auto& b : {live.get(), forgetful.get()})
            (void)b->advance(0, {.linear_tolerance = 1e-9, .max_iterations = 1});
        if (k <= 12) continue;
        ASSERT_TRUE(exact->solve(0, {.tolerance = 1e-6}).converged);
        error += test::largest_gap(live->displacement(), exact->displacement());
        without += test::largest_gap(forgetful->displacement(), exact->displacement());
    }
    EXPECT_LT(error, 0.36 * without);  // 0.33; with two frames before 0.43
}

/// The whole body turned by 25 degrees a step: halves of an operator that are a step apart do not
/// fit together.
TEST_F(LiveSolverTest, AsksForTheWholeOperatorWhereHalvesLeadAstray) {
    const TetMesh& mesh = hierarchy.levels.front();
    const auto ends =
        test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9 || x.x() > 0.1999; });
    const Vector3 centre = test::beam_size / 2;
    const auto turn_of = [](int k) -> Eigen::Matrix3d {
        return Eigen::AngleAxisd(k * 25 * M_PI / 180, Vector3::UnitZ()).toRotationMatrix() -
               Eigen::Matrix3d::Identity();
    };
    const auto turned = [&](const Eigen::Matrix3d& turn) {
        Constraints constraints(mesh.nodes.size());
        for (const std::int32_t n : ends)
            constraints.prescribe(std::span(&n, 1), turn * (mesh.nodes[n] - centre));
        return constraints;
    };
    int asked = 0;
    double worst[2] = {0, 0};
    for (const RenewalExtent renewal : {RenewalExtent::whole, RenewalExtent::half}) {
        const bool halves = renewal == RenewalExtent::half;
        const auto live = body({.kind = SolverKind::live}),
                   replay = body({.kind = SolverKind::live});
        for (int k = 1; k <= 60; ++k) {
            for (const auto& b : {live.get(), replay.get()}) b->set_constraints(turned(turn_of(k)));
            const StepReport report = live->advance(
                0, {.linear_tolerance = 1e-3, .max_iterations = 3, .renewal = renewal});
            asked += halves && k > 15 && !report.half_renewed;
            const auto u = live->displacement();
            // A replay does not make the solve that was rejected; it must not tell.
            (void)replay->advance(0, {.linear_tolerance = 1e-3, .as_done = &report.solves});
            ASSERT_TRUE(replay->displacement() == u) << k;
            for (std::size_t n = 0; n < u.size(); ++n)
                worst[halves] =
                    std::max(worst[halves], (u[n] - turn_of(k) * (mesh.nodes[n] - centre)).norm());
        }
    }
    EXPECT_GT(asked, 0);
    EXPECT_LT(worst[1], 2 * worst[0]);
}

TEST_F(LiveSolverTest, KeepsTheOldStateWhereTheNewOneWouldBeOutOfThisWorld) {
    const auto live = body({.kind = SolverKind::live});
    live->set_constraints(pressed(0.1));
    ASSERT_FALSE(live->advance(0, {.linear_tolerance = 1e-6}).kept_old);
    const auto before = live->displacement();
    live->set_constraints(pressed(1e7));  // finite, but floats of forces would not be for long
    const StepReport lost = live->advance(0, {.linear_tolerance = 1e-6});
    EXPECT_TRUE(lost.kept_old);
    EXPECT_EQ(std::string_view(lost.reason).find("the displacement is "), 0u) << lost.reason;
    EXPECT_EQ(live->displacement(), before);
    live->set_constraints(pressed(0.2));
    EXPECT_FALSE(live->advance(0, {.linear_tolerance = 1e-6}).kept_old);
    EXPECT_LT(test::largest_gap(live->displacement(), before), 0.01);
}

/// A press and back by halves of the operator comes as near to equilibrium as by whole ones.
TEST_F(LiveSolverTest, RenewsByHalvesWhatADeadlineLeavesNoTimeFor) {
    const auto exact = body({.kind = SolverKind::live});
    double worst[2] = {0, 0};
    for (const RenewalExtent renewal : {RenewalExtent::whole, RenewalExtent::half}) {
        const bool halves = renewal == RenewalExtent::half;
        const auto live = body({.kind = SolverKind::live, .threads = 2});
        for (int k = 1; k <= 60; ++k) {
            const Constraints constraints = pressed(k <= 40 ? k / 40.0 : (80 - k) / 40.0);
            live->set_constraints(constraints);
            const StepReport report = live->advance(
                0, {.linear_tolerance = 1e-9, .max_iterations = 4, .renewal = renewal});
            EXPECT_EQ(report.half_renewed, halves && k > 11) << k;  // setting off is a jump
            if (k % 20) continue;
            exact->set_constraints(constraints);
            ASSERT_TRUE(
                exact->solve(0, {.max_newton = 30, .tolerance = 1e-5, .linear_tolerance = 1e-2})
                    .converged)
                << k;
            worst[halves] = std::max(
                worst[halves], test::largest_gap(live->displacement(), exact->displacement()));
        }
    }
    EXPECT_LT(worst[1], 3 * worst[0]);
    // The time step may vary meanwhile, as a tracker's stamps do: inertia is that of now, whichever
    // half is renewed.
    const TimeOptions time{
        .scheme = TimeScheme::newmark, .rayleigh_alpha = 5, .rayleigh_beta = 0.01};
    const auto whole = body({.kind = SolverKind::live}, time),
               by_halves = body({.kind = SolverKind::live}, time);
    for (int k = 1; k <= 20; ++k)
        for (DeformableBody* b : {whole.get(), by_halves.get()}) {
            const bool halves = b == by_halves.get();
            b->set_constraints(pressed(1e-3 * k));
            const StepReport report =
                b->advance(0.02 * (1 + 0.02 * (k % 2)),
                           {.linear_tolerance = 1e-6,
                            .renewal = halves ? RenewalExtent::half : RenewalExtent::whole});
            EXPECT_EQ(report.half_renewed, halves && k > 11) << k;
        }
    EXPECT_LT(test::largest_gap(whole->displacement(), by_halves->displacement()),
              1e-2 * 0.0155 * 0.02);

    const auto late = body({.kind = SolverKind::live});
    late->set_constraints(pressed(0.1));  // so little that single iterations lower the residual
    for (int k = 1; k <= 12; ++k) {
        const StepReport report = late->advance(0, {.deadline = Clock::now()});
        EXPECT_EQ(report.half_renewed, k > 10) << k;
        EXPECT_EQ(report.iterations, 1);
    }
}

}  // namespace
}  // namespace livetet
