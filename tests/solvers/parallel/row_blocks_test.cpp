#include "solvers/parallel/row_blocks.hpp"

#include <gtest/gtest.h>

#include "support/ranks.hpp"

namespace livetet {
namespace {

/// Row i belongs to rank i * i modulo the ranks, so that each block comes from several ranks and a
/// rank may own none.
TEST(RowBlocks, ValuesGoToTheirBlocksAndBack) {
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    const int ranks = test::rank_count();
    for (const int rows : {0, 1, 3, 100}) {  // some fewer than ranks
        std::vector<std::int32_t> mine;
        std::vector<double> values;
        for (int i = rows; i-- > 0;)
            if (i * i % ranks == rank) {
                mine.push_back(i);
                for (int c = 0; c < 3; ++c) values.push_back(10 * i + c);
            }
        const RowBlocks blocks(PETSC_COMM_WORLD, static_cast<std::size_t>(rows), mine);
        const std::vector<double> block = blocks.to_block(values, 3);
        ASSERT_EQ(block.size(), 3 * blocks.block().size());
        for (std::size_t i = 0; i < block.size(); ++i) {
            const auto row = static_cast<double>(blocks.block().first + i / 3);
            EXPECT_EQ(block[i], 10 * row + static_cast<double>(i % 3)) << rows;
        }
        EXPECT_EQ(blocks.from_block(block, 3), values) << rows;
    }
}

TEST(RowBlocks, RangesOfRanksCoverAllRowsOnce) {
    for (const std::size_t rows : {0, 1, 7, 1000})
        for (const std::size_t ranks : {1, 3, 8}) {
            std::size_t next = 0;
            for (std::size_t r = 0; r < ranks; ++r) {
                const RowRange range = row_range(rows, r, ranks);
                EXPECT_EQ(range.first, next);
                EXPECT_LE(range.size(), rows / ranks + 1);
                next = range.end;
            }
            EXPECT_EQ(next, rows);
        }
}

}  // namespace
}  // namespace livetet
