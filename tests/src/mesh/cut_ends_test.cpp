// Where a cut ends inside the cells of the next coarser level.

#include "mesh/cut_ends.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "base/disjoint_sets.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

/// The level without the links across the plane x = `at` whose cells begin at y >= `from`.
HexLevel cut_at(HexLevel level, int at, int from) {
    std::erase_if(level.links, [&](const HexLink& link) {
        const HexPlace& lower = level.places[link.lower];
        return link.axis == 0 && lower[0] == at - 1 && lower[1] >= from;
    });
    return make_hex_level(std::move(level.places), std::move(level.links));
}

/// A block of n cells of unit length, cut so.
HexLevel cut_block(std::array<int, 3> n, int at, int from) {
    return cut_at(hex_level_of(test::hex_grid(n, Vector3(n[0], n[1], n[2])), "a block"), at, from);
}

/// With the coarse cells that are linked parts, as parents.
HexLevel with_closed_parents(HexLevel level) {
    DisjointSets parts(level.places.size());
    const auto parent = [&](std::int32_t cell) {
        const HexPlace& p = level.places[cell];
        return HexPlace{p[0] / 2, p[1] / 2, p[2] / 2};
    };
    for (const HexLink& link : level.links)
        if (parent(link.lower) == parent(link.upper)) parts.join(link.lower, link.upper);
    std::map<std::int32_t, std::int32_t> number;
    level.parents.clear();
    for (std::int32_t e = 0; e < std::ssize(level.places); ++e)
        level.parents.push_back(
            number.try_emplace(parts.find(e), static_cast<std::int32_t>(number.size()))
                .first->second);
    return level;
}

/// How many links the next coarser level is to do without.
std::size_t opened_links(const HexLevel& level) {
    return level.links.size() - links_without_cut_ends(with_closed_parents(level)).size();
}

/// How many rows of coarse cells along y the plane x = `at` parts.
int parted_rows(HexLevel level, int at) {
    const HexLevel coarse = coarser_level(level);
    int rows = 0;
    for (int row = 0; row < 4; ++row) {
        std::set<std::int32_t> parents;
        bool linked = false;
        for (std::size_t e = 0; e < level.places.size(); ++e) {
            const HexPlace& p = level.places[e];
            if ((p[0] == at || p[0] == at - 1) && p[1] / 2 == row && p[2] < 2)
                parents.insert(level.parents[e]);
        }
        for (const HexLink& link : coarse.links)
            linked = linked || (link.axis == 0 && parents.contains(link.lower) &&
                                parents.contains(link.upper));
        rows += parents.size() == 2 && !linked;
    }
    return rows;
}

/// A cut through the middle of coarse cells (x = 3) or between them (x = 4), uncut below `from`.
TEST(CutEnds, ACutThatEndsInACoarseCellGoesToTheCellsNearerBorder) {
    for (const int at : {3, 4}) {
        SCOPED_TRACE(at);
        // At the border of coarse cells nothing is to be decided.
        EXPECT_EQ(parted_rows(cut_block({8, 8, 4}, at, 4), at), 2);
        EXPECT_EQ(opened_links(cut_block({8, 8, 4}, at, 4)), 0);
        // Halfway: the cell with the end is opened, one link of two in each of the four layers.
        EXPECT_EQ(parted_rows(cut_block({8, 8, 4}, at, 3), at), 3);
        EXPECT_EQ(opened_links(cut_block({8, 8, 4}, at, 3)), 4);
    }
}

/// With nothing beside it to hold the halves together, the last bridge stays.
TEST(CutEnds, ABridgeAtTheBodysBorderStays) {
    for (const int at : {3, 4}) {
        SCOPED_TRACE(at);
        HexLevel level = cut_block({8, 8, 4}, at, 1);
        EXPECT_EQ(parted_rows(level, at), 3);
        EXPECT_EQ(count_pieces(coarser_level(level)), 1);
        HexLevel loose = cut_block({8, 8, 4}, at, 0);
        EXPECT_EQ(count_pieces(coarser_level(loose)), 2);
    }
}

/// It does not keep other cuts from ending where they should.
TEST(CutEnds, ABridgeThatStaysLeavesOthersToBeOpened) {
    for (const int at : {9, 10}) {
        SCOPED_TRACE(at);
        HexLevel level = cut_at(cut_block({16, 8, 4}, 3, 1), at, 3);
        EXPECT_EQ(parted_rows(level, at), 3);
        EXPECT_EQ(parted_rows(level, 3), 3);
        EXPECT_EQ(count_pieces(coarser_level(level)), 1);
    }
}

TEST(CutEnds, AnUncutBodyKeepsItsLinks) {
    for (const std::array<int, 3> n : {std::array{7, 5, 3}, std::array{8, 8, 8}}) {
        HexLevel level = hex_level_of(test::hex_grid(n, Vector3(n[0], n[1], n[2])), "a block");
        EXPECT_EQ(opened_links(std::move(level)), 0);
    }
}

/// Number of coarse cells if each is one linked part, and whether cuts end in some.
std::pair<std::size_t, bool> closed_cells(const HexLevel& level) {
    const HexLevel closed = with_closed_parents(level);
    return {1 + *std::ranges::max_element(closed.parents), opened_links(level) > 0};
}

/// Each level has the pieces of the body, whatever is cut. On most levels in which cuts end so
/// cells are opened; on some that would free a piece.
TEST(CutEnds, NoLevelHasAPieceMoreOrLess) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(0, 1);
    int with_ends = 0, opened = 0;
    for (int k = 0; k < 300; ++k) {
        SCOPED_TRACE(k);
        const TetMesh mesh = test::hex_grid({10, 9, 8}, {10, 9, 8});
        HexLevel level = hex_level_of(mesh, "a block");
        // Up to three planes, each uncut within a random ball.
        for (int cut = 0; cut < 1 + k % 3; ++cut) {
            const Vector3 normal =
                Vector3(uniform(random), uniform(random), uniform(random)) - 0.5 * Vector3::Ones();
            const Vector3 through(10 * uniform(random), 9 * uniform(random), 8 * uniform(random)),
                bridge(10 * uniform(random), 9 * uniform(random), 8 * uniform(random));
            const double radius = 4 * uniform(random);
            const auto middle = [&](std::int32_t cell) -> Vector3 {
                const HexPlace& p = level.places[cell];
                return Vector3(p[0], p[1], p[2]) + 0.5 * Vector3::Ones();
            };
            std::erase_if(level.links, [&](const HexLink& link) {
                const Vector3 a = middle(link.lower), b = middle(link.upper);
                return (normal.dot(a - through) > 0) != (normal.dot(b - through) > 0) &&
                       (a - bridge).norm() > radius;
            });
        }
        HexLevel fine = make_hex_level(level.places, level.links);
        const std::size_t pieces = count_pieces(fine);
        for (int l = 0; l < 3; ++l) {
            const auto [closed, has_ends] = closed_cells(fine);
            HexLevel coarse = coarser_level(fine);
            with_ends += has_ends;
            opened += coarse.cells.size() > closed;
            ASSERT_EQ(count_pieces(coarse), pieces) << "level " << l;
            ASSERT_EQ(fine.parents.size(), fine.places.size());
            fine = std::move(coarse);
        }
    }
    EXPECT_GT(opened, 100);
    EXPECT_GT(with_ends, opened) << "some stay closed";
    RecordProperty("with_ends", with_ends);
    RecordProperty("opened", opened);
}

}  // namespace
}  // namespace livetet
