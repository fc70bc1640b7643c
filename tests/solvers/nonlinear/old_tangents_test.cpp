// Newton's method that begins with the tangent that is there.

#include <gtest/gtest.h>

#include "solvers/inverse/block_fixture.hpp"

namespace livetet {
namespace {

/// From a state that was linearised, a little more force: the same equilibrium, and no tangent is
/// assembled, of which the time set down would tell.
TEST(OldTangents, ASmallStepNeedsNoOther) {
    test::PulledBlock block("neohookean");
    const ForceBasis basis = uniform_forces(block.zone);
    const Eigen::Vector3d pull(0.5, 0.2, 1.6);  // N
    const std::size_t nodes = block.mesh().nodes.size();
    const auto more = [&](int old_tangents) {
        block.body.linearise();
        Eigen::MatrixXd unused;
        EXPECT_TRUE(block.body.responses(basis.matrix(nodes), 1e-8, unused).converged);
        block.body.set_external_force(basis.force(1.02 * pull, nodes));
        return block.body.solve(
            0, {.tolerance = 1e-9, .linear_tolerance = 1e-8, .old_tangents = old_tangents});
    };
    (void)block.equilibrium(basis, pull);
    const StepReport newton = more(0);
    ASSERT_TRUE(newton.converged) << newton.reason;
    const std::vector<Vector3> exact = block.body.displacement();
    EXPECT_GT(newton.preconditioner_s, 0);

    (void)block.equilibrium(basis, pull);
    const StepReport chord = more(20);
    ASSERT_TRUE(chord.converged) << chord.reason;
    EXPECT_EQ(chord.preconditioner_s, 0);
    EXPECT_GE(chord.newton_iterations, newton.newton_iterations);
    const std::vector<Vector3> found = block.body.displacement();
    for (std::size_t n = 0; n < nodes; ++n) EXPECT_LT((found[n] - exact[n]).norm(), 1e-8);

    // Where none of the first iterations is enough, the tangent is renewed.
    (void)block.equilibrium(basis, pull);
    const StepReport mixed = more(1);
    ASSERT_TRUE(mixed.converged) << mixed.reason;
    EXPECT_GT(mixed.preconditioner_s, 0);
}

}  // namespace
}  // namespace livetet
