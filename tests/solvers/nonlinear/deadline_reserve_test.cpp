#include "solvers/nonlinear/deadline_reserve.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "solvers/nonlinear/deformable_body.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

constexpr double iteration_s = 5e-4, slice_s = 4e-3, budget_s = 15e-3;

/// The clock of a machine whose neighbours take a tenth of the time, in slices of 4 ms. Each look
/// at it comes half a millisecond of work after the last.
struct BusyMachine {
    static inline double now_s = 0;
    static inline std::mt19937 generator;

    static void start() {
        now_s = 0;
        generator.seed(7);
    }
    static Clock::time_point read() {
        std::bernoulli_distribution is_interrupted(iteration_s / (9 * slice_s));
        now_s += iteration_s + (is_interrupted(generator) ? slice_s : 0);
        return Clock::time_point() +
               std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(now_s));
    }
    static Deadline frame() { return Deadline::after(read(), budget_s, &read); }
};

/// The share of late frames among those after the first `unlearned`, of frames that iterate until
/// less than 1.5 iterations' time is left.
template <class Before, class Learn>
double late_share(const Before& before, const Learn& learn) {
    constexpr int frames = 20000, unlearned = 500;
    BusyMachine::start();
    int late = 0;
    for (int k = 0; k < frames; ++k) {
        const Deadline deadline = BusyMachine::frame(), aim = before(deadline);
        while (aim.left_s() > 1.5 * iteration_s) {
        }
        const bool is_late = deadline.left_s() < 0;
        learn(is_late);
        late += k >= unlearned && is_late;
    }
    return static_cast<double>(late) / (frames - unlearned);
}

TEST(DeadlineReserveTest, KeepsNinetyNineOfAHundredFramesWhereNeighboursTakeATenth) {
    DeadlineReserve reserve;
    EXPECT_LT(late_share([&](const Deadline& d) { return reserve.before(d); },
                         [&](bool late) { reserve.learn(late); }),
              0.01);
    // Less than a slice and an iteration would not do; more than two would be waste.
    EXPECT_GT(reserve.seconds(), slice_s - iteration_s);
    EXPECT_LT(reserve.seconds(), 2 * slice_s);
    EXPECT_GT(late_share([](const Deadline& d) { return d; }, [](bool) {}), 0.05);
}

TEST(DeadlineReserveTest, TakesNothingFromFramesThatAreInTime) {
    DeadlineReserve reserve;
    BusyMachine::start();
    const Deadline deadline = BusyMachine::frame();
    for (int k = 0; k < 3; ++k) {
        const double left_s = deadline.left_s();
        EXPECT_NEAR(reserve.before(deadline).left_s(), left_s, 3 * iteration_s);
        reserve.learn(false);
    }
    EXPECT_EQ(reserve.seconds(), 0);
}

TEST(DeadlineReserveTest, GivesUpHalfOfAFrameAtMost) {
    DeadlineReserve reserve;
    const auto still = +[] { return Clock::time_point(); };
    const Deadline deadline = Deadline::after(Clock::time_point(), budget_s, still);
    for (int k = 0; k < 50; ++k) {
        EXPECT_GE(reserve.before(deadline).left_s(), 0.499 * budget_s);
        reserve.learn(true);
    }
    EXPECT_NEAR(reserve.before(deadline).left_s(), budget_s / 2, 1e-6);
    EXPECT_LE(reserve.before(Deadline::after(Clock::time_point(), -1, still)).left_s(), -1);
}

/// How many of 400 frames of a block whose patch sways are late; each is solved as far as it can.
int late_frames(const Deadline::ReadClock read) {
    const MeshHierarchy hierarchy = make_hierarchy(
        {test::block({4, 2, 2}, test::beam_size), test::block({2, 1, 1}, test::beam_size)},
        "a block");
    const TetMesh& mesh = hierarchy.levels.front();
    const std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.4}};
    DeformableBody body({PETSC_COMM_SELF, hierarchy},
                        {materials, "neohookean", Formulation::displacement}, {},
                        {.kind = SolverKind::live, .threads = 1});
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                          Vector3::Zero());
    const auto patch = test::nodes_where(
        mesh, [](const Vector3& x) { return x.x() > test::beam_size.x() - 1e-9; });
    constraints.prescribe(patch, Vector3::Zero());
    body.set_constraints(constraints);
    BusyMachine::start();
    int late = 0;
    for (int k = 0; k < 400; ++k) {
        const Vector3 to(0, 0, 0.01 * std::sin(0.2 * k));
        body.move_constraints(patch, std::vector<Vector3>(patch.size(), to));
        const StepReport report = body.advance(
            0, {.linear_tolerance = 0, .deadline = Deadline::after(read(), budget_s, read)});
        EXPECT_FALSE(report.kept_old);
        late += report.late;
    }
    return late;
}

TEST(DeadlineReserveTest, FramesOfABodyLeaveTheTime) {
    if (test::rank_count() > 1) GTEST_SKIP() << "frames with a deadline are made on one rank";
    // One in a hundred, and those that it is learned from.
    EXPECT_LE(late_frames(&BusyMachine::read), 8);
}

}  // namespace
}  // namespace livetet
