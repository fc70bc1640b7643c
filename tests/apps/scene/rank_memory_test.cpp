#include "apps/scene/rank_memory.hpp"

#include <gtest/gtest.h>

#include "mesh/quadratic.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

TEST(RankMemory, SharesWhatIsOwn) {
    const std::vector<LevelSize> levels{
        size_of_level(test::block({20, 10, 10}, test::beam_size), true),
        size_of_level(test::block({3, 2, 2}, test::beam_size), true)};
    const std::size_t tets = levels[0].tets;
    const RankMemory one = memory_of_rank(levels, 1, 0, tets),
                     eight = memory_of_rank(levels, 8, 0, tets);
    EXPECT_EQ(one.own, levels[0].bytes + levels[1].bytes);
    EXPECT_EQ(one.whole, levels[0].mesh_bytes + levels[1].mesh_bytes);
    EXPECT_EQ(memory_of_rank(levels, 2, 0, tets).whole, 0)
        << "a rank's own comes when METIS has ended";
    EXPECT_GT(memory_of_rank(levels, 60, 0, tets).whole, eight.whole);
    EXPECT_EQ(memory_of_rank(levels, 60, 1, levels[1].tets).whole, 0)
        << "ranks make the fine level themselves";
    EXPECT_LT(memory_of_rank(levels, 60, 0, 0).whole, memory_of_rank(levels, 60, 0, tets).whole)
        << "PTScotch";
    EXPECT_EQ(memory_of_rank(levels, 1, 1, levels[1].tets).whole, one.whole);
    EXPECT_EQ(one.program, eight.program);
    // The coarse level stays on one rank; each share of the fine one has its neighbours' nodes.
    const double even = levels[0].bytes / 8 + levels[1].bytes;
    EXPECT_GT(eight.own, 1.1 * even);
    EXPECT_LT(eight.own, 2 * even);
    EXPECT_LT(memory_of_rank(levels, 60, 0, tets).own, eight.own);
    EXPECT_EQ(memory_of_rank(levels, 100, 0, tets).own, memory_of_rank(levels, 1000, 0, tets).own)
        << "a rank has 200 tets or none";
}

TEST(RankMemory, TenNodesTakeMore) {
    const TetMesh linear = test::block({6, 3, 3}, test::beam_size);
    const LevelSize four = size_of_level(linear, true),
                    ten = size_of_level(quadratic_mesh(linear), true);
    EXPECT_EQ(four.tets, ten.tets);
    EXPECT_GT(ten.bytes, 5 * four.bytes);
    EXPECT_GT(ten.mesh_bytes, 2 * four.mesh_bytes);
    EXPECT_LT(size_of_level(linear, false).bytes, four.bytes);
    EXPECT_LT(size_of_level(quadratic_mesh(linear), false).bytes, ten.bytes / 2);
}

}  // namespace
}  // namespace livetet
