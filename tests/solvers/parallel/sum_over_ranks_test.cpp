#include "solvers/parallel/sum_over_ranks.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "support/ranks.hpp"

namespace livetet {
namespace {

/// More numbers than go at once, none, and one.
TEST(SumOverRanks, EveryNumberOnEveryRank) {
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    const int ranks = test::rank_count(), ranks_before = ranks * (ranks - 1) / 2;
    for (const std::size_t count : {0UL, 1UL, 300'001UL}) {
        std::vector<double> values(count);
        for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<double>(i) + 2 * rank;
        sum_over_ranks(PETSC_COMM_WORLD, values);
        for (std::size_t i = 0; i < count; ++i)
            ASSERT_EQ(values[i], static_cast<double>(i) * ranks + 2 * ranks_before) << i;
    }
}

}  // namespace
}  // namespace livetet
