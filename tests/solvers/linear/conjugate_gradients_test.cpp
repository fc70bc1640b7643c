#include "solvers/linear/conjugate_gradients.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace livetet {
namespace {

constexpr int springs = 6000;  // several pieces of a sum

/// A chain of springs between two walls, each a little stiffer than the one before, and Jacobi's
/// preconditioner.
class Chain : public SingleSystem {
  public:
    void apply(std::span<float> x, std::span<float> y) override {
        for (int i = 0; i < springs; ++i) {
            const float before = i > 0 ? x[i - 1] : 0, after = i + 1 < springs ? x[i + 1] : 0;
            y[i] = sign * (stiffness(i) * (x[i] - before) + stiffness(i + 1) * (x[i] - after) +
                           ground * x[i]);
        }
        ++products;
    }
    void precondition(std::span<const float> r, std::span<float> z) override {
        for (int i = 0; i < springs; ++i)
            z[i] = of_preconditioner * r[i] / (stiffness(i) + stiffness(i + 1) + ground);
        if (calls++ == odd_call)
            for (int i = 0; i < springs; ++i) z[i] *= i % 3 == 0 ? 0.5F * odd_sign : odd_sign;
    }
    static float stiffness(int i) { return 1 + 0.3F * std::sin(0.01F * static_cast<float>(i)); }

    float sign = 1, ground = 0.2F, of_preconditioner = 1;
    int products = 0, calls = 0;
    int odd_call = -1;   ///< in which a third of the chain counts for less
    float odd_sign = 1;  ///< of what it gives
};

class ConjugateGradientsTest : public testing::Test {
  protected:
    static PetscHandle<Vec> vector_of(double frequency) {
        PetscHandle<Vec> v;
        LIVETET_PETSC(VecCreateSeq(PETSC_COMM_SELF, springs, v.out()));
        WriteArray to(v.get());
        for (int i = 0; i < springs; ++i) to[i] = std::cos(frequency * i) + 0.1;
        return v;
    }
    /// |b - A x| / |b|, in double precision.
    double left_of(Vec b, Vec x) const {
        const ReadArray from(b), at(x);
        double squares = 0, whole = 0;
        for (int i = 0; i < springs; ++i) {
            const double before = i > 0 ? at[i - 1] : 0, after = i + 1 < springs ? at[i + 1] : 0;
            const double Ax =
                chain.sign * (Chain::stiffness(i) * (at[i] - before) +
                              Chain::stiffness(i + 1) * (at[i] - after) + chain.ground * at[i]);
            squares += (from[i] - Ax) * (from[i] - Ax);
            whole += from[i] * from[i];
        }
        return std::sqrt(squares / whole);
    }
    KSPConvergedReason solve(Vec b, Vec x, double tolerance, EarlierSolves* earlier = nullptr,
                             int max_iterations = 200) {
        PetscReal size = 0;
        LIVETET_PETSC(VecNorm(b, NORM_2, &size));
        gradients.begin(b, earlier);
        stopping.begin({.relative_tolerance = tolerance, .max_iterations = max_iterations},
                       tolerance * size);
        const KSPConvergedReason reason = gradients.run(x, stopping);
        error = stopping.end();
        return reason;
    }

    Chain chain;
    ThreadTeam team{2};
    StoppingTest stopping{team, ErrorEstimate::from_steps};
    ConjugateGradients gradients{chain, springs, team};
    PetscHandle<Vec> b = vector_of(0.3), x = vector_of(0), y = vector_of(0);
    double error = 0;
};

TEST_F(ConjugateGradientsTest, ASystemIsSolved) {
    EXPECT_EQ(solve(b.get(), x.get(), 1e-5), KSP_CONVERGED_RTOL);
    EXPECT_LE(left_of(b.get(), x.get()), 1.05e-5);
    EXPECT_GT(gradients.iterations(), 5);
    EXPECT_LT(gradients.iterations(), 60);
    EXPECT_GT(error, 0);
}

TEST_F(ConjugateGradientsTest, WhatIsLeftIsWhatItSays) {
    EXPECT_EQ(solve(b.get(), x.get(), 1e-12, nullptr, 4), KSP_DIVERGED_ITS);
    EXPECT_EQ(gradients.iterations(), 4);
    const double left = left_of(b.get(), x.get());
    PetscReal size = 0;
    LIVETET_PETSC(VecNorm(b.get(), NORM_2, &size));
    EXPECT_NEAR(gradients.residual() / size, left, 1e-5 * left);
    gradients.image(b.get(), y.get());
    LIVETET_PETSC(VecAYPX(y.get(), -1, b.get()));
    PetscReal of_image = 0;
    LIVETET_PETSC(VecNorm(y.get(), NORM_2, &of_image));
    EXPECT_NEAR(of_image / size, left, 1e-5 * left);
}

TEST_F(ConjugateGradientsTest, OneIterationIsEnoughWhereThePreconditionerIsTheInverse) {
    chain.ground = 1e6F;  // all but diagonal
    EXPECT_EQ(solve(b.get(), x.get(), 1e-5), KSP_CONVERGED_RTOL);
    EXPECT_EQ(gradients.iterations(), 1);
}

TEST_F(ConjugateGradientsTest, AFirstPreconditionerThatIsAnotherCostsLittle) {
    EXPECT_EQ(solve(b.get(), x.get(), 1e-5), KSP_CONVERGED_RTOL);
    const int iterations = gradients.iterations();
    chain.odd_call = chain.calls;
    EXPECT_EQ(solve(b.get(), x.get(), 1e-5), KSP_CONVERGED_RTOL);
    EXPECT_LE(left_of(b.get(), x.get()), 1.05e-5);
    EXPECT_LE(gradients.iterations(), iterations + 3);
    // One that is not positive is made anew.
    chain.odd_call = chain.calls;
    chain.odd_sign = -1;
    EXPECT_EQ(solve(b.get(), x.get(), 1e-5), KSP_CONVERGED_RTOL);
    EXPECT_EQ(gradients.iterations(), iterations);
}

/// The error is what steps to come would add up to, if each were shorter than the one before by a
/// ratio: at first 0.3, and a fifth of the way to that of the last two steps.
TEST_F(ConjugateGradientsTest, TheErrorIsEstimatedFromTheSteps) {
    const auto rms_to = [&](Vec before) {
        LIVETET_PETSC(VecAXPY(before, -1, x.get()));
        PetscReal size = 0;
        LIVETET_PETSC(VecNorm(before, NORM_2, &size));
        return size / std::sqrt(springs / 3.0);
    };
    LIVETET_PETSC(VecSet(y.get(), 0));
    (void)solve(b.get(), x.get(), 1e-12, nullptr, 1);
    const double first = rms_to(y.get());
    EXPECT_NEAR(error, first * 0.3 / 0.7, 1e-5 * error);
    LIVETET_PETSC(VecCopy(x.get(), y.get()));
    (void)solve(b.get(), x.get(), 1e-12, nullptr, 2);
    const double second = rms_to(y.get()), ratio = 0.3 + 0.2 * (second / first - 0.3);
    EXPECT_NEAR(error, second * ratio / (1 - ratio), 1e-4 * error);
}

TEST_F(ConjugateGradientsTest, EarlierSolvesAreAStart) {
    EarlierSolves earlier(EarlierSolves::Nearness::energy, team);
    for (const double frequency : {0.3, 0.31}) {
        const auto right = vector_of(frequency);
        (void)solve(right.get(), x.get(), 1e-6, &earlier);
        EXPECT_EQ(gradients.has_start(), frequency != 0.3);
        gradients.image(right.get(), y.get());
        earlier.keep(x.get(), y.get());
    }
    // b is half of the one and half of the other.
    const auto other = vector_of(0.31);
    LIVETET_PETSC(VecAXPBY(b.get(), 0.5, 0.5, other.get()));
    EXPECT_EQ(solve(b.get(), x.get(), 1e-4, &earlier), KSP_CONVERGED_RTOL);
    EXPECT_EQ(gradients.iterations(), 0);
    EXPECT_LE(left_of(b.get(), x.get()), 1e-4);
    // Iterations go on from it.
    EXPECT_EQ(solve(b.get(), x.get(), 1e-12, &earlier, 3), KSP_DIVERGED_ITS);
    EXPECT_EQ(gradients.iterations(), 3);
    EXPECT_LE(left_of(b.get(), x.get()), 1e-5);
}

TEST_F(ConjugateGradientsTest, AnOperatorThatIsNotPositiveEndsIt) {
    chain.sign = -1;
    EXPECT_EQ(solve(b.get(), x.get(), 1e-5), KSP_DIVERGED_INDEFINITE_MAT);
    PetscReal size = 0;
    LIVETET_PETSC(VecNorm(x.get(), NORM_2, &size));
    EXPECT_EQ(size, 0);
}

TEST_F(ConjugateGradientsTest, ItGoesOnWithAnotherOperator) {
    EXPECT_EQ(solve(b.get(), x.get(), 1e-12, nullptr, 3), KSP_DIVERGED_ITS);
    const double before = left_of(b.get(), x.get());
    chain.ground = 0.21F;
    gradients.renew_residual(b.get(), x.get());
    const double left = left_of(b.get(), x.get());
    PetscReal size = 0;
    LIVETET_PETSC(VecNorm(b.get(), NORM_2, &size));
    EXPECT_NEAR(gradients.residual() / size, left, 1e-5 * left);
    EXPECT_NE(left, before);
    stopping.begin({.relative_tolerance = 1e-5, .max_iterations = 200}, 1e-5 * size);
    EXPECT_EQ(gradients.run(x.get(), stopping), KSP_CONVERGED_RTOL);
    EXPECT_LE(left_of(b.get(), x.get()), 1.05e-5);
    EXPECT_GT(gradients.iterations(), 4);
}

TEST_F(ConjugateGradientsTest, MonitorsAreToldOfEachResidual) {
    PetscHandle<KSP> ksp;
    LIVETET_PETSC(KSPCreate(PETSC_COMM_SELF, ksp.out()));
    std::vector<double> told;
    const auto monitor = [](KSP, PetscInt, PetscReal residual, void* list) noexcept {
        static_cast<std::vector<double>*>(list)->push_back(residual);
        return PetscErrorCode{0};
    };
    LIVETET_PETSC(KSPMonitorSet(ksp.get(), monitor, &told, nullptr));
    gradients.begin(b.get());
    stopping.begin({.relative_tolerance = 1e-12, .max_iterations = 3}, 0);
    (void)gradients.run(x.get(), stopping, ksp.get());
    ASSERT_EQ(told.size(), 4U);
    EXPECT_EQ(told.back(), gradients.residual());
    EXPECT_LT(told.back(), told.front());
}

TEST_F(ConjugateGradientsTest, APreconditionerThatIsNotPositiveEndsIt) {
    chain.of_preconditioner = -1;
    EXPECT_EQ(solve(b.get(), x.get(), 1e-5), KSP_DIVERGED_INDEFINITE_PC);
}

TEST_F(ConjugateGradientsTest, NothingIsLeftToDoForZero) {
    LIVETET_PETSC(VecSet(b.get(), 0));
    EXPECT_EQ(solve(b.get(), x.get(), 1e-5), KSP_CONVERGED_RTOL);
    EXPECT_EQ(gradients.iterations(), 0);
    PetscReal size = 1;
    LIVETET_PETSC(VecNorm(x.get(), NORM_2, &size));
    EXPECT_EQ(size, 0);
}

TEST_F(ConjugateGradientsTest, NotANumberEndsIt) {
    WriteArray(b.get())[17] = NAN;
    EXPECT_EQ(solve(b.get(), x.get(), 1e-5), KSP_DIVERGED_NANORINF);
}

TEST_F(ConjugateGradientsTest, TheSameBitsOnAnyNumberOfThreads) {
    (void)solve(b.get(), x.get(), 1e-5);
    for (const int threads : {1, 4}) {
        ThreadTeam other_team(threads);
        StoppingTest test(other_team, ErrorEstimate::from_steps);
        ConjugateGradients other(chain, springs, other_team);
        other.begin(b.get());
        PetscReal size = 0;
        LIVETET_PETSC(VecNorm(b.get(), NORM_2, &size));
        test.begin({.relative_tolerance = 1e-5, .max_iterations = 200}, 1e-5 * size);
        EXPECT_EQ(other.run(y.get(), test), KSP_CONVERGED_RTOL);
        PetscBool same = PETSC_FALSE;
        LIVETET_PETSC(VecEqual(x.get(), y.get(), &same));
        EXPECT_TRUE(same) << threads;
    }
}

}  // namespace
}  // namespace livetet
