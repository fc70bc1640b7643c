#include "solvers/parallel/team_vector.hpp"

#include <gtest/gtest.h>
#include <petsc/private/vecimpl.h>

#include <cmath>
#include <vector>

namespace livetet {

namespace {

constexpr PetscInt size = 20011;

double value(PetscInt i, int of) { return std::sin(0.7 * static_cast<double>(i) + of); }

/// A vector of PETSc's with value(i, of); with a team, run on it.
PetscHandle<Vec> make(int of, ThreadTeam* team) {
    PetscHandle<Vec> v;
    LIVETET_PETSC(VecCreateMPI(PETSC_COMM_SELF, size, size, v.out()));
    if (team) run_on_team(v.get(), *team);
    WriteArray to(v.get());
    for (PetscInt i = 0; i < size; ++i) to[i] = value(i, of);
    return v;
}

void spoil(Vec v) {
    WriteArray values(v);
    values[3] = NAN;
}

/// What each operation makes of the vectors, and the sums.
struct Results {
    std::vector<double> values, sums;
};

Results use(ThreadTeam* team) {
    Results results;
    const auto run = [&](auto&& operation) {
        const PetscHandle<Vec> x = make(1, team), y = make(2, team), w = make(3, team);
        operation(x.get(), y.get(), w.get());
        const ReadArray found(w.get());
        results.values.insert(results.values.end(), found.span().begin(), found.span().end());
    };
    run([](Vec, Vec, Vec w) { LIVETET_PETSC(VecSet(w, 1.5)); });
    run([](Vec, Vec, Vec w) { LIVETET_PETSC(VecScale(w, -0.3)); });
    run([](Vec x, Vec, Vec w) { LIVETET_PETSC(VecCopy(x, w)); });
    run([](Vec x, Vec, Vec w) {  // PETSc's write over what is not finite
        spoil(w);
        LIVETET_PETSC(VecAXPBY(w, 0.3, 0, x));
    });
    run([](Vec x, Vec, Vec w) {
        spoil(w);
        LIVETET_PETSC(VecAYPX(w, 0, x));
    });
    run([](Vec, Vec, Vec w) {
        spoil(w);
        LIVETET_PETSC(VecScale(w, 0));
    });
    run([](Vec x, Vec, Vec w) { LIVETET_PETSC(VecAXPY(w, 0.3, x)); });
    run([](Vec x, Vec, Vec w) { LIVETET_PETSC(VecAXPBY(w, 0.3, 0.6, x)); });
    run([](Vec x, Vec, Vec w) { LIVETET_PETSC(VecAYPX(w, 0.6, x)); });
    run([](Vec x, Vec y, Vec w) { LIVETET_PETSC(VecWAXPY(w, 0.6, x, y)); });
    run([](Vec x, Vec y, Vec w) {
        const PetscScalar factors[] = {0.2, -0.7, 0.1, 0.3, 1.2, -0.4, 0.6, -1.1, 0.9, 0.5};
        Vec terms[] = {x, y, y, x, x, y, x, y, x, y};
        LIVETET_PETSC(VecMAXPY(w, 10, factors, terms));
    });
    run([&](Vec x, Vec y, Vec w) {
        const Vec factors[] = {x, y, w, y, x, w, w, x, y, y};
        PetscScalar dots[10] = {};
        PetscReal norm = 0, largest = 0;
        LIVETET_PETSC(VecMDot(w, 10, factors, dots));
        results.sums.insert(results.sums.end(), dots, dots + 10);
        LIVETET_PETSC(VecMTDot(w, 10, factors, dots));
        results.sums.insert(results.sums.end(), dots, dots + 10);
        LIVETET_PETSC(VecDot(x, y, dots));
        LIVETET_PETSC(VecTDot(x, y, dots + 1));
        LIVETET_PETSC(VecNorm(x, NORM_2, &norm));
        LIVETET_PETSC(VecNorm(y, NORM_INFINITY, &largest));
        results.sums.insert(results.sums.end(), {dots[0], dots[1], norm, largest});
    });
    return results;
}

void expect_near(const std::vector<double>& found, const std::vector<double>& expected,
                 double allowed) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], expected[i], allowed) << i;
}

TEST(TeamVector, DoesWhatPetscsVectorsDo) {
    const Results expected = use(nullptr);
    for (const int threads : {1, 2, 4}) {
        ThreadTeam team(threads);
        const Results found = use(&team);
        expect_near(found.values, expected.values, 1e-15);
        expect_near(found.sums, expected.sums, 1e-9);
    }
}

TEST(TeamVector, HasTheSameBitsOnAnyNumberOfThreads) {
    ThreadTeam one(1), two(2), four(4);
    const Results of_one = use(&one);
    for (ThreadTeam* team : {&two, &four}) {
        const Results of_more = use(team);
        EXPECT_EQ(of_more.values, of_one.values);
        EXPECT_EQ(of_more.sums, of_one.sums);
    }
}

/// Whether `v` has the operations of vectors on a team.
bool is_on_team(Vec v) {
    ThreadTeam team(1);
    const PetscHandle<Vec> on_team = make(1, &team), plain = make(1, nullptr);
    EXPECT_NE(on_team.get()->ops->dot, plain.get()->ops->dot);
    return v->ops->dot == on_team.get()->ops->dot && v->ops->axpy == on_team.get()->ops->axpy;
}

TEST(TeamVector, HasDuplicatesThatRunOnItsTeam) {
    ThreadTeam team(2);
    const PetscHandle<Vec> v = make(1, &team);
    PetscHandle<Vec> twin, twin_of_twin;
    LIVETET_PETSC(VecDuplicate(v.get(), twin.out()));
    LIVETET_PETSC(VecDuplicate(twin.get(), twin_of_twin.out()));
    PetscReal norm = -1;
    LIVETET_PETSC(VecNorm(twin_of_twin.get(), NORM_2, &norm));
    EXPECT_EQ(norm, 0);
    EXPECT_TRUE(is_on_team(twin.get()));
    EXPECT_TRUE(is_on_team(twin_of_twin.get()));
}

TEST(TeamVector, WorksWithVectorsWithoutATeam) {
    ThreadTeam team(2);
    const PetscHandle<Vec> on_team = make(1, &team), plain = make(2, nullptr);
    PetscScalar dots[2] = {};
    LIVETET_PETSC(VecDot(on_team.get(), plain.get(), dots));
    LIVETET_PETSC(VecDot(plain.get(), on_team.get(), dots + 1));
    EXPECT_NEAR(dots[0], dots[1], 1e-9);
    LIVETET_PETSC(VecAXPY(on_team.get(), 2, plain.get()));
    LIVETET_PETSC(VecCopy(on_team.get(), plain.get()));
    const ReadArray found(plain.get());
    EXPECT_NEAR(found[7], value(7, 1) + 2 * value(7, 2), 1e-15);
}

TEST(TeamVector, OutlivesTheOneThatItIsADuplicateOf) {
    ThreadTeam team(2);
    PetscHandle<Vec> twin;
    {
        const PetscHandle<Vec> v = make(1, &team);
        LIVETET_PETSC(VecDuplicate(v.get(), twin.out()));
    }
    EXPECT_TRUE(is_on_team(twin.get()));
    PetscScalar sum = 0;
    LIVETET_PETSC(VecSet(twin.get(), 2));
    LIVETET_PETSC(VecDot(twin.get(), twin.get(), &sum));
    EXPECT_EQ(sum, 4.0 * size);
}

}  // namespace

}  // namespace livetet
