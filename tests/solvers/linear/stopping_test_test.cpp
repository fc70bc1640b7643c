#include "solvers/linear/stopping_test.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "support/petsc_options.hpp"

namespace livetet {
namespace {

/// A x = b with A = diag(1, ..., n) / n, by conjugate gradients without a preconditioner; on each
/// rank its own.
class Stopping : public testing::Test {
  protected:
    static constexpr PetscInt n = 60;

    void SetUp() override {
        LIVETET_PETSC(MatCreateSeqAIJ(PETSC_COMM_SELF, n, n, 1, nullptr, A.out()));
        for (PetscInt i = 0; i < n; ++i)
            LIVETET_PETSC(MatSetValue(A.get(), i, i, (i + 1.0) / n, INSERT_VALUES));
        LIVETET_PETSC(MatAssemblyBegin(A.get(), MAT_FINAL_ASSEMBLY));
        LIVETET_PETSC(MatAssemblyEnd(A.get(), MAT_FINAL_ASSEMBLY));
        LIVETET_PETSC(MatCreateVecs(A.get(), x.out(), b.out()));
        LIVETET_PETSC(VecSet(b.get(), 1));
        LIVETET_PETSC(KSPCreate(PETSC_COMM_SELF, ksp.out()));
        LIVETET_PETSC(KSPSetOperators(ksp.get(), A.get(), A.get()));
        LIVETET_PETSC(KSPSetType(ksp.get(), KSPCG));
        PC pc = nullptr;
        LIVETET_PETSC(KSPGetPC(ksp.get(), &pc));
        LIVETET_PETSC(PCSetType(pc, PCNONE));
        LIVETET_PETSC(KSPSetResidualHistory(ksp.get(), residuals.data(),
                                            static_cast<PetscInt>(residuals.size()), PETSC_TRUE));
        stopping.install(ksp.get());
    }
    /// Solves; the iterations that it took.
    int solve() {
        LIVETET_PETSC(KSPSolve(ksp.get(), b.get(), x.get()));
        LIVETET_PETSC(KSPGetConvergedReason(ksp.get(), &reason));
        PetscInt iterations = 0;
        LIVETET_PETSC(KSPGetIterationNumber(ksp.get(), &iterations));
        return static_cast<int>(iterations);
    }
    /// Expects that the last residual is the first of at most `allowed`.
    void expect_first_below(double allowed, int iterations) const {
        EXPECT_EQ(reason, KSP_CONVERGED_RTOL);
        ASSERT_GT(iterations, 1);
        EXPECT_LE(residuals[iterations], allowed);
        for (int k = 0; k < iterations; ++k) EXPECT_GT(residuals[k], allowed) << k;
    }

    PetscHandle<Mat> A;
    PetscHandle<Vec> x, b;
    PetscHandle<KSP> ksp;
    std::array<PetscReal, 200> residuals{};
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    StoppingTest stopping{ThreadTeam::alone(), ErrorEstimate::none};
};

TEST_F(Stopping, EndsAtTheFirstResidualThatIsAllowed) {
    for (const double allowed : {0.1, 1e-6}) {
        stopping.begin({.max_iterations = 150}, allowed);
        const int iterations = solve();
        expect_first_below(allowed, iterations);
        EXPECT_EQ(stopping.end(), 0);
    }
}

TEST_F(Stopping, EndsAfterTheIterationsAllowed) {
    stopping.begin({.max_iterations = 3}, 1e-9);
    EXPECT_EQ(solve(), 3);
    EXPECT_EQ(reason, KSP_DIVERGED_ITS);
}

TEST_F(Stopping, ADeadlineThatIsPastLeavesOneIteration) {
    stopping.begin({.max_iterations = 150, .deadline = Clock::now() - std::chrono::seconds(1)},
                   1e-9);
    EXPECT_EQ(solve(), 1);
    EXPECT_EQ(reason, KSP_CONVERGED_ITS);
    stopping.begin({.max_iterations = 150, .deadline = Clock::now() + std::chrono::hours(1)}, 1e-6);
    expect_first_below(1e-6, solve());
}

TEST_F(Stopping, WithoutBeginTheKrylovSolversOwnTolerancesHold) {
    LIVETET_PETSC(KSPSetTolerances(ksp.get(), 1e-3, 1e-50, PETSC_DEFAULT, 150));
    stopping.begin({.max_iterations = 1}, 1e9);
    (void)stopping.end();
    const int iterations = solve();
    expect_first_below(1e-3 * std::sqrt(n), iterations);
    LIVETET_PETSC(KSPSetTolerances(ksp.get(), 1e-9, 1e-2, PETSC_DEFAULT, 150));
    expect_first_below(1e-2, solve());
    LIVETET_PETSC(KSPSetTolerances(ksp.get(), 1e-9, 1e-50, PETSC_DEFAULT, 2));
    EXPECT_EQ(solve(), 2);
}

TEST_F(Stopping, AResidualThatIsNotFiniteEndsItAtOnce) {
    // Called as a Krylov solver would: those of PETSc find most such residuals by themselves.
    PetscErrorCode (*test)(KSP, PetscInt, PetscReal, KSPConvergedReason*, void*) = nullptr;
    PetscErrorCode (*destroy)(void*) = nullptr;
    void* context = nullptr;
    LIVETET_PETSC(KSPGetConvergenceTest(ksp.get(), &test, &context, &destroy));
    stopping.begin({.max_iterations = 150}, 1e-6);
    for (const double residual :
         {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
        LIVETET_PETSC(test(ksp.get(), 2, residual, &reason, context));
        EXPECT_EQ(reason, KSP_DIVERGED_NANORINF);
    }
}

TEST_F(Stopping, LeavesATestThatTheOptionsName) {
    LIVETET_PETSC(KSPSetConvergenceTest(ksp.get(), KSPConvergedSkip, nullptr, nullptr));
    LIVETET_PETSC(KSPSetTolerances(ksp.get(), 1e-3, 1e-50, PETSC_DEFAULT, 7));
    const test::PetscOptions set({std::pair("-ksp_convergence_test", "skip")});
    stopping.install(ksp.get());
    stopping.begin({.max_iterations = 3}, 1e9);
    EXPECT_EQ(solve(), 7);
}

/// Richardson's iteration on A = I with half of the residual a time: each step is half of the one
/// before, and all that are still to come add up to the last one.
TEST_F(Stopping, EstimatesTheErrorFromTheRatioOfSteps) {
    StoppingTest estimating(ThreadTeam::alone(), ErrorEstimate::from_steps);
    LIVETET_PETSC(MatZeroEntries(A.get()));
    LIVETET_PETSC(MatShift(A.get(), 1));
    LIVETET_PETSC(KSPSetType(ksp.get(), KSPRICHARDSON));
    LIVETET_PETSC(KSPRichardsonSetScale(ksp.get(), 0.5));
    estimating.install(ksp.get());
    const double first = std::sqrt(3);  // RMS over nodes of three components, each off by one
    double error = 0;
    for (int k = 0; k < 60; ++k) {
        estimating.begin({.max_iterations = 5}, 1e-9);
        EXPECT_EQ(solve(), 5);
        error = estimating.end();
        if (k > 0) continue;
        EXPECT_NEAR(error, first / 32 * 0.34 / 0.66, 1e-12);  // 0.34 = 0.3 + 0.2 (0.5 - 0.3)
    }
    EXPECT_NEAR(error, first / 32, 1e-6);
}

}  // namespace
}  // namespace livetet
