#include "solvers/parallel/dual_graph.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "solvers/parallel/exchange.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// Against all pairs, on every number of ranks, some with no tet.
TEST(DualGraph, NeighboursShareThreeNodes) {
    for (const std::array<int, 3> cells : {std::array{4, 3, 2}, std::array{1, 1, 1}}) {
        const TetMesh mesh = test::block(cells, Vector3(0.4, 0.3, 0.2));
        const TetMesh rows = test::rows_of(mesh);
        const Lists neighbours = tet_neighbours(PETSC_COMM_WORLD, rows.tets, test::size_of(mesh));
        ASSERT_EQ(neighbours.start.size(), rows.tets.size() + 1);
        for (std::size_t e = 0; e < rows.tets.size(); ++e) {
            std::vector<std::int32_t> expected;
            for (std::size_t other = 0; other < mesh.tets.size(); ++other)
                if (std::ranges::count_if(rows.tets[e], [&](std::int32_t n) {
                        return std::ranges::count(mesh.tets[other], n) > 0;
                    }) == 3)
                    expected.push_back(static_cast<std::int32_t>(other));
            EXPECT_EQ(std::vector(neighbours[e].begin(), neighbours[e].end()), expected) << e;
        }
    }
}

TEST(Exchange, ItemsComeByRanksInTheirOrder) {
    const int ranks = test::rank_count(), rank = test::rank();
    std::vector<std::int32_t> to;
    std::vector<std::array<std::int32_t, 3>> items;
    for (std::int32_t i = 0; i < 5; ++i)
        for (std::int32_t r = ranks; r-- > 0;)
            if ((i + r + rank) % 2 == 0) {  // some pairs of ranks exchange less than others
                to.push_back(r);
                items.push_back({rank, r, i});
            }
    std::vector<std::array<std::int32_t, 3>> expected;
    for (std::int32_t from = 0; from < ranks; ++from)
        for (std::int32_t i = 0; i < 5; ++i)
            if ((i + rank + from) % 2 == 0) expected.push_back({from, rank, i});
    EXPECT_EQ(exchange(PETSC_COMM_WORLD, to, items), expected);
    const std::vector<std::array<std::int32_t, 3>> none;
    EXPECT_EQ(exchange(PETSC_COMM_WORLD, {}, none), none);
}

}  // namespace
}  // namespace livetet
