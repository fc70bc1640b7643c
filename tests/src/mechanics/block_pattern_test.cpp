#include "mechanics/block_pattern.hpp"

#include <gtest/gtest.h>

#include <set>

#include "mesh/tet_mesh.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// Every block of every tet stands where its row and column say, once.
void expect_places(const BlockPattern& pattern, std::span<const Tet> tets) {
    std::set<std::pair<int, std::int32_t>> all;
    for (std::size_t e = 0; e < tets.size(); ++e)
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) {
                const std::int32_t row = tets[e][i], column = tets[e][j];
                if (row >= pattern.owned()) continue;
                const int part = pattern.part_of(column);
                const std::int32_t place = pattern.place(e, i, j, row, column);
                ASSERT_EQ(place, pattern.place(row, column)) << e << ' ' << i << ' ' << j;
                const Lists& rows = pattern.rows(part);
                ASSERT_GE(place, rows.start[row]);
                ASSERT_LT(place, rows.start[row + 1]);
                ASSERT_EQ(rows.items[place], column - (part == 1 ? pattern.owned() : 0));
                all.emplace(part, place);
            }
    EXPECT_EQ(all.size(), pattern.size(0) + pattern.size(1)) << "a block that no tet has";
}

TEST(BlockPattern, HasABlockForEveryTwoNodesOfATet) {
    const TetMesh mesh = test::block({4, 3, 3}, {1, 1, 1});
    const std::size_t nodes = mesh.nodes.size();
    const BlockPattern whole(mesh.tets, nodes);
    expect_places(whole, mesh.tets);
    EXPECT_EQ(whole.size(1), 0u);
    const auto owned = static_cast<std::int32_t>(nodes / 3);
    const BlockPattern third(mesh.tets.size(), 4, nodes, owned,
                             [&](std::size_t e, int i) { return mesh.tets[e][i]; });
    expect_places(third, mesh.tets);
    EXPECT_GT(third.size(1), 0u);
    for (std::int32_t i = 0; i < owned; ++i)
        EXPECT_EQ(third.rows(0)[i].size() + third.rows(1)[i].size(), whole.rows(0)[i].size());
}

/// More blocks in a row than a byte counts: a node that 400 tets meet at.
TEST(BlockPattern, ARowMayBeLong) {
    std::vector<Tet> tets;
    for (std::int32_t k = 0; k < 400; ++k) tets.push_back({700, k, k + 1, k + 2});
    const BlockPattern pattern(tets, 701);
    EXPECT_GT(pattern.rows(0)[700].size(), 400u);
    expect_places(pattern, tets);
}

}  // namespace
}  // namespace livetet
