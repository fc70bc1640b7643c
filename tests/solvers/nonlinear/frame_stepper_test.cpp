#include "solvers/nonlinear/frame_stepper.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

/// A block held at x = 0 and pressed by a patch on its top, with all that a FrameStepper needs.
class PressedBlock {
  public:
    explicit PressedBlock(SolverKind kind = SolverKind::multigrid)
        : hierarchy_(make_hierarchy(
              {test::block({8, 4, 4}, test::beam_size), test::block({4, 2, 2}, test::beam_size)},
              "a block")),
          parts_(parts_of(hierarchy_)),
          options_{.kind = kind, .tangent = TangentChoice::frozen_rotation},
          solver_(make_linear_solver({PETSC_COMM_WORLD, hierarchy_, parts_},
                                     {materials_, "corotated", Formulation::displacement},
                                     options_)),
          time_({}, solver_->fine(), state, ThreadTeam::alone()),
          prescribed_(solver_->fine()),
          balance_(*solver_, time_, prescribed_, state, ThreadTeam::alone()),
          stepper_(balance_, time_, prescribed_, *solver_, state, options_, ThreadTeam::alone()) {
        press(Vector3::Zero());
    }
    const TetMesh& mesh() const { return hierarchy_.levels.front(); }
    std::vector<std::int32_t> patch() const {
        return test::nodes_where(mesh(), [](const Vector3& x) {
            return x.z() > 0.0999 && std::abs(x.x() - 0.1) < 0.03;
        });
    }
    void press(const Vector3& by) {
        const PartitionedMesh& share = solver_->fine().share();
        Constraints constraints(mesh().nodes.size());
        constraints.prescribe(
            test::nodes_where(mesh(), [](const Vector3& x) { return x.x() < 1e-9; }),
            Vector3::Zero());
        constraints.prescribe(patch(), by);
        if (constrained_ != constraints.components) {
            constrained_ = constraints.components;
            solver_->set_constrained(local_part<std::uint8_t>(share, constrained_));
            prescribed_.find_nodes();
        }
        constraints.values = local_part<Vector3>(share, constraints.values);
        prescribed_.set_values(constraints);
    }
    StepReport frame(const FrameControls& controls) {
        time_.begin_step(0);
        balance_.begin_step(ForceBalance::DampingAt::present);
        prescribed_.find_increment(state.u.get());
        const StepReport report = stepper_.advance(controls);
        if (report.kept_old)
            time_.return_to_start();
        else
            (void)time_.finish_step(0);
        return report;
    }
    std::vector<Vector3> displacement() const {
        return test::gather(solver_->fine().share(), state.u.get());
    }

    BodyState state;

  private:
    static std::vector<std::vector<std::int32_t>> parts_of(const MeshHierarchy& hierarchy) {
        const int ranks = test::rank_count();
        std::vector<std::vector<std::int32_t>> parts;
        for (const TetMesh& level : hierarchy.levels)
            parts.push_back(partition_tets(level.tets, ranks));
        return parts;
    }

    const MeshHierarchy hierarchy_;
    const std::vector<std::vector<std::int32_t>> parts_;
    const std::vector<Material> materials_{{.young_Pa = 3000, .poisson = 0.4}};
    const SolverOptions options_;
    std::unique_ptr<LinearSolver> solver_;
    TimeIntegrator time_;
    PrescribedMotion prescribed_;
    ForceBalance balance_;
    FrameStepper stepper_;
    std::vector<std::uint8_t> constrained_;
};

TEST(FrameStepperTest, ADeadlineThatIsPastLeavesOneIterationAndThePatchWhereItBelongs) {
    PressedBlock block;
    const Vector3 way(0, 0.002, -0.01);
    block.press(way);
    const StepReport report =
        block.frame({.linear_tolerance = 1e-9, .deadline = Clock::now() - std::chrono::seconds(1)});
    EXPECT_EQ(report.iterations, 1);
    EXPECT_EQ(report.newton_iterations, 1);
    EXPECT_TRUE(report.cut_short);
    EXPECT_TRUE(report.converged);
    EXPECT_FALSE(report.kept_old);
    const auto u = block.displacement();
    for (const std::int32_t n : block.patch()) EXPECT_LT((u[n] - way).norm(), 1e-15);
    for (const Vector3& v : u) ASSERT_TRUE(v.allFinite() && v.norm() < 2 * way.norm());
}

/// A clock that goes on by a millisecond each time it is read.
Clock::time_point next_millisecond() {
    static Clock::time_point now{};
    return now += std::chrono::milliseconds(1);
}

TEST(FrameStepperTest, NewtonIterationsShareTheTimeUntilTheDeadline) {
    PressedBlock block;
    block.press({0, 0.002, -0.01});
    const StepReport report =
        block.frame({.newton_iterations = 2,
                     .linear_tolerance = 1e-12,
                     .deadline = Deadline::after(next_millisecond(), 0.02, &next_millisecond)});
    ASSERT_EQ(report.newton_iterations, 2);
    EXPECT_TRUE(report.cut_short);
    EXPECT_GT(report.solves[1].iterations, 1) << "the first solve has not taken all";
    EXPECT_LT(report.iterations, 20);
}

TEST(FrameStepperTest, MoreNewtonIterationsComeNearerToEquilibrium) {
    double before = 1;
    for (const int iterations : {2, 4}) {
        PressedBlock block;
        block.press({0, 0.004, -0.02});
        const StepReport report =
            block.frame({.newton_iterations = iterations, .linear_tolerance = 1e-8});
        EXPECT_EQ(report.newton_iterations, iterations);
        EXPECT_LT(report.imbalance, 0.3 * before);
        before = report.imbalance;
    }
}

/// Halves of an operator fit together while the patch moves steadily, not until ten steps after a
/// jump.
TEST(FrameStepperTest, RenewsHalvesButNotSoonAfterAJump) {
    if (test::rank_count() > 1) GTEST_SKIP() << "the live solver is for one rank";
    PressedBlock block(SolverKind::live);
    Vector3 at = Vector3::Zero();
    for (int k = 1; k <= 40; ++k) {
        at.z() += k == 20 ? -2e-3 : -1e-4;
        block.press(at);
        const StepReport report =
            block.frame({.linear_tolerance = 1e-6, .renewal = RenewalExtent::half});
        EXPECT_EQ(report.half_renewed, (k > 11 && k < 20) || k >= 30) << k;
    }
}

TEST(FrameStepperTest, RepeatsAFrameToTheBit) {
    PressedBlock first, again;
    for (int k = 1; k <= 4; ++k) {
        for (PressedBlock* block : {&first, &again}) block->press({0, 0, -0.002 * k});
        FrameControls controls{.newton_iterations = 2, .linear_tolerance = 1e-6};
        if (k % 2) controls.max_iterations = k;  // as if by the clock
        const StepReport done = first.frame(controls);
        const StepReport report = again.frame(
            {.newton_iterations = 2, .linear_tolerance = 1e-6, .as_done = &done.solves});
        EXPECT_EQ(report.iterations, done.iterations);
        EXPECT_EQ(first.displacement(), again.displacement()) << k;
    }
}

}  // namespace
}  // namespace livetet
