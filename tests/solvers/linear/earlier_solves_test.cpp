#include "solvers/linear/earlier_solves.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

namespace livetet {
namespace {

constexpr int components = 4000;  // several pieces of a sum, on several ranks

/// Ten modes of sines, and an operator that is diagonal in components: 1 + `turned` of a sine, so
/// that it changes with `turned`.
class EarlierSolvesTest : public testing::TestWithParam<EarlierSolves::Nearness> {
  protected:
    using Nearness = EarlierSolves::Nearness;

    static PetscHandle<Vec> vector_of(const std::function<double(double)>& value) {
        PetscHandle<Vec> v;
        PetscInt begin = 0, end = 0;
        LIVETET_PETSC(VecCreateMPI(PETSC_COMM_WORLD, PETSC_DECIDE, components, v.out()));
        LIVETET_PETSC(VecGetOwnershipRange(v.get(), &begin, &end));
        WriteArray to(v.get());
        for (PetscInt i = begin; i < end; ++i) to[i - begin] = value((i + 0.5) / components);
        return v;
    }
    static PetscHandle<Vec> mode(int k) {
        return vector_of([k](double at) { return std::sin(M_PI * (k + 1) * at); });
    }
    static PetscHandle<Mat> operator_at(double turned, double sign = 1) {
        PetscHandle<Mat> A;
        const auto diagonal = vector_of(
            [&](double at) { return sign * (2 + std::cos(9 * at) + turned * std::sin(40 * at)); });
        PetscInt own = 0;
        LIVETET_PETSC(VecGetLocalSize(diagonal.get(), &own));
        LIVETET_PETSC(MatCreateAIJ(PETSC_COMM_WORLD, own, own, components, components, 1, nullptr,
                                   0, nullptr, A.out()));
        LIVETET_PETSC(MatDiagonalSet(A.get(), diagonal.get(), INSERT_VALUES));
        return A;
    }
    static PetscHandle<Vec> times(Mat A, Vec x) {
        PetscHandle<Vec> y;
        LIVETET_PETSC(VecDuplicate(x, y.out()));
        LIVETET_PETSC(MatMult(A, x, y.get()));
        return y;
    }
    static double norm(Vec v) {
        PetscReal size = 0;
        LIVETET_PETSC(VecNorm(v, NORM_2, &size));
        return size;
    }
    /// The sum of the first `count` modes, each times its number.
    static PetscHandle<Vec> sum_of_modes(int count) {
        return vector_of([count](double at) {
            double sum = 0;
            for (int k = 0; k < count; ++k) sum += (k + 1) * std::sin(M_PI * (k + 1) * at);
            return sum;
        });
    }
    void keep_modes(int count, double turned) {
        const PetscHandle<Mat> A = operator_at(turned);
        for (int k = 0; k < count; ++k) {
            const auto x = mode(k), y = times(A.get(), x.get());
            (void)earlier.find_start(A.get(), y.get());
            earlier.keep(x.get(), y.get());
        }
    }
    /// What is left of b = A x after the start, relative to |b|; 1 where it is of no use.
    double left_of(Vec x, double turned) {
        const PetscHandle<Mat> A = operator_at(turned);
        const auto b = times(A.get(), x);
        if (!earlier.find_start(A.get(), b.get())) return 1;
        // rest() is what it says.
        const auto image = times(A.get(), earlier.start());
        LIVETET_PETSC(VecAYPX(image.get(), -1, b.get()));
        LIVETET_PETSC(VecAXPY(image.get(), -1, earlier.rest()));
        EXPECT_LE(norm(image.get()), 1e-12 * norm(b.get()));
        return norm(earlier.rest()) / norm(b.get());
    }

    ThreadTeam team{2};
    EarlierSolves earlier{GetParam(), team};
};

TEST_P(EarlierSolvesTest, WhatTheyMakeUpIsFound) {
    keep_modes(EarlierSolves::max_solutions, 0);
    EXPECT_LE(left_of(sum_of_modes(EarlierSolves::max_solutions).get(), 0), 1e-5);  // kept in float
}

TEST_P(EarlierSolvesTest, AnOperatorThatChangedALittleLeavesLittle) {
    keep_modes(EarlierSolves::max_solutions, 0);
    const auto x = sum_of_modes(EarlierSolves::max_solutions);
    const double near = left_of(x.get(), 0.01), far = left_of(x.get(), 0.1);
    EXPECT_LE(near, 0.01);
    EXPECT_LE(far, 0.1);
    EXPECT_GT(far, 3 * near);
}

TEST_P(EarlierSolvesTest, AScaledOperatorTakesTheSameCombination) {
    keep_modes(EarlierSolves::max_solutions, 0);
    const PetscHandle<Mat> A = operator_at(0);
    const auto x = sum_of_modes(EarlierSolves::max_solutions), b = times(A.get(), x.get());
    LIVETET_PETSC(MatScale(A.get(), 3));
    LIVETET_PETSC(VecScale(b.get(), 3));
    ASSERT_TRUE(earlier.find_start(A.get(), b.get()));
    EXPECT_LE(norm(earlier.rest()), 1e-5 * norm(b.get()));
}

TEST_P(EarlierSolvesTest, TheOldestIsForgotten) {
    keep_modes(EarlierSolves::max_solutions + 1, 0);
    EXPECT_GT(left_of(mode(0).get(), 0), 0.1);
    for (int k = 1; k <= EarlierSolves::max_solutions; ++k)
        EXPECT_LE(left_of(mode(k).get(), 0), 1e-5) << k;
}

TEST_P(EarlierSolvesTest, TheSameSolutionTwiceIsNoHarm) {
    const PetscHandle<Mat> A = operator_at(0);
    keep_modes(2, 0);
    const auto x = mode(1), y = times(A.get(), x.get());
    earlier.keep(x.get(), y.get());
    EXPECT_LE(left_of(sum_of_modes(2).get(), 0), 1e-5);
}

TEST_P(EarlierSolvesTest, OfSolutionsThatAreAlmostAlikeTheNewestIsTakenWhereTheOperatorChanges) {
    PetscHandle<Vec> newest;
    PetscHandle<Mat> A;
    for (int k = 0; k < EarlierSolves::max_solutions; ++k) {
        A = operator_at(0, std::pow(1.1, k));
        newest = mode(0);
        LIVETET_PETSC(VecAXPY(newest.get(), 0.01 * k, mode(1).get()));
        const auto y = times(A.get(), newest.get());
        (void)earlier.find_start(A.get(), y.get());
        earlier.keep(newest.get(), y.get());
    }
    const auto b = times(A.get(), mode(0).get());
    ASSERT_TRUE(earlier.find_start(A.get(), b.get()));
    PetscScalar along = 0;
    LIVETET_PETSC(VecDot(earlier.start(), newest.get(), &along));
    EXPECT_GT(along, (1 - 1e-9) * norm(earlier.start()) * norm(newest.get()));
}

TEST_P(EarlierSolvesTest, SolutionsThatAreAlmostAlikeAreToldApartWhereTheOperatorStays) {
    const PetscHandle<Mat> A = operator_at(0);
    for (const double share : {0.0, 0.01}) {
        auto x = mode(0);
        LIVETET_PETSC(VecAXPY(x.get(), share, mode(1).get()));
        const auto y = times(A.get(), x.get());
        (void)earlier.find_start(A.get(), y.get());
        earlier.keep(x.get(), y.get());
    }
    EXPECT_LE(left_of(sum_of_modes(2).get(), 0), 1e-3);
}

TEST_P(EarlierSolvesTest, NothingIsOfUseAtFirstNorOnceForgotten) {
    EXPECT_EQ(left_of(mode(0).get(), 0), 1);
    keep_modes(2, 0);
    EXPECT_LT(left_of(mode(0).get(), 0), 1);
    earlier.clear();
    EXPECT_EQ(left_of(mode(0).get(), 0), 1);
}

TEST_P(EarlierSolvesTest, ZeroAndNotANumberAreOfNoUse) {
    const PetscHandle<Mat> A = operator_at(0);
    keep_modes(2, 0);
    EXPECT_FALSE(earlier.find_start(A.get(), vector_of([](double) { return 0.0; }).get()));
    EXPECT_FALSE(earlier.find_start(A.get(), vector_of([](double) { return NAN; }).get()));
}

TEST_P(EarlierSolvesTest, ASolutionThatIsNotFiniteIsNotKept) {
    keep_modes(1, 0);
    const auto bad = vector_of([](double at) { return at < 0.5 ? NAN : 0; });
    earlier.keep(bad.get(), bad.get());
    keep_modes(2, 0);
    EXPECT_LE(left_of(sum_of_modes(2).get(), 0), 1e-5);
}

TEST_P(EarlierSolvesTest, AnOperatorOfTheOtherSignIsNotFollowed) {
    keep_modes(2, 0);
    const PetscHandle<Mat> negative = operator_at(0, -1);
    const auto b = times(negative.get(), mode(0).get());
    EXPECT_FALSE(earlier.find_start(negative.get(), b.get()));
}

INSTANTIATE_TEST_SUITE_P(, EarlierSolvesTest,
                         testing::Values(EarlierSolves::Nearness::energy,
                                         EarlierSolves::Nearness::residual),
                         [](const auto& info) {
                             return info.param == EarlierSolves::Nearness::energy ? "energy"
                                                                                  : "residual";
                         });

}  // namespace
}  // namespace livetet
