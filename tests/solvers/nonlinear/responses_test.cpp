// Responses to many forces: of a factorisation, which takes all columns at once, against solves one
// by one, and against small changes of an equilibrium.

#include <gtest/gtest.h>

#include "solvers/inverse/block_fixture.hpp"

namespace livetet {
namespace {

/// Pulled to an equilibrium beyond small strain, at which K is positive.
struct SolvedBlock : test::PulledBlock {
    ForceBasis basis = smooth_forces(mesh().nodes, zone, 3);
    Eigen::VectorXd pull = Eigen::VectorXd::Constant(9, 0.1);  // N

    explicit SolvedBlock(SolverKind kind, Formulation formulation = Formulation::displacement)
        : PulledBlock("neohookean", formulation, 1, kind) {
        (void)equilibrium(basis, pull);
        body.linearise();
    }
    Eigen::MatrixXd responses(LinearReport& report) {
        Eigen::MatrixXd x;
        report = body.responses(basis.matrix(mesh().nodes.size()), 1e-10, x);
        EXPECT_TRUE(report.converged) << report.reason;
        return x;
    }
};

class Responses : public testing::TestWithParam<Formulation> {};

TEST_P(Responses, AreTheSameAllAtOnceAndOneByOne) {
    LinearReport at_once, alone;
    const Eigen::MatrixXd x = SolvedBlock(SolverKind::direct, GetParam()).responses(at_once);
    const Eigen::MatrixXd y = SolvedBlock(SolverKind::gamg, GetParam()).responses(alone);
    if (GetParam() == Formulation::displacement) {
        EXPECT_STREQ(at_once.reason, "solved by a factorisation");
    }
    EXPECT_GT(alone.iterations, 1);
    for (Eigen::Index j = 0; j < x.cols(); ++j)
        EXPECT_LT((x.col(j) - y.col(j)).norm(), 1e-6 * x.col(j).norm()) << "column " << j;
}

INSTANTIATE_TEST_SUITE_P(Forms, Responses,
                         testing::Values(Formulation::displacement, Formulation::mixed),
                         [](const auto& info) {
                             return std::string(info.param == Formulation::mixed ? "mixed"
                                                                                 : "displacement");
                         });

TEST(ResponsesTest, AreTheChangesOfAnEquilibriumAndZeroWhereFixed) {
    SolvedBlock block(SolverKind::direct);
    LinearReport report;
    const Eigen::MatrixXd x = block.responses(report);
    const double h = 1e-3;  // N
    const auto at = [&](double step) {
        return test::as_column(
            block.equilibrium(block.basis, block.pull + step * Eigen::VectorXd::Unit(9, 4)));
    };
    const Eigen::VectorXd change = (at(h) - at(-h)) / (2 * h);
    EXPECT_LT((x.col(4) - change).norm(), 1e-4 * change.norm());
    for (std::size_t n = 0; n < block.mesh().nodes.size(); ++n)
        if (block.mesh().nodes[n].z() < 1e-9) {
            EXPECT_EQ(x.middleRows<3>(3 * static_cast<Eigen::Index>(n)).norm(), 0) << "node " << n;
        }
}

TEST(ResponsesTest, AreOfForcesAtEveryNode) {
    SolvedBlock block(SolverKind::direct);
    Eigen::MatrixXd x;
    EXPECT_THROW((void)block.body.responses(Eigen::MatrixXd::Zero(6, 2), 1e-6, x), Error);
    const Eigen::Index rows = 3 * std::ssize(block.mesh().nodes);
    EXPECT_TRUE(block.body.responses(Eigen::MatrixXd::Zero(rows, 0), 1e-6, x).converged);
    EXPECT_EQ(x.cols(), 0);
}

}  // namespace
}  // namespace livetet
