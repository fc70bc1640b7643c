// What blades cut of a grid, and when it is to be opened.

#include "apps/live/blade_cuts.hpp"

#include <gtest/gtest.h>

#include "mesh/mesh_pieces.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

/// A grid of 4 x 4 x 4 cells of 10 mm, at rest.
struct BladedGrid {
    TetMesh mesh = test::hex_grid({4, 4, 4}, {0.04, 0.04, 0.04});
    std::vector<Vector3> still = std::vector<Vector3>(mesh.nodes.size(), Vector3::Zero());
    BladeCuts cuts{{mesh}, 0.5};
    double time_s = 0;

    TetMesh opened() { return cuts.open({mesh}).levels.front(); }
    /// Leads an edge from its place by `way`, in steps of 0.04 s.
    void sweep(const BladeEdge& edge, const Vector3& way, int frames = 10) {
        cuts.change_blades();
        for (int k = 0; k <= frames; ++k) {
            const Vector3 moved = static_cast<double>(k) / frames * way;
            const std::optional<BladeEdge> edges[] = {BladeEdge{edge[0] + moved, edge[1] + moved}};
            cuts.follow(time_s += 0.04, edges, mesh, still);
        }
    }
};

/// Cuts all around cells at a lower corner, from and up to a place along x.
void cut_around_corner(BladedGrid& grid, double from, double to) {
    grid.sweep({Vector3(to, 0.002, -0.002), Vector3(to, 0.008, -0.002)}, {0, 0, 0.009});
    grid.sweep({Vector3(from, 0.009, -0.002), Vector3(to - 0.001, 0.009, -0.002)}, {0, 0, 0.009});
    grid.sweep({Vector3(from, 0.002, 0.009), Vector3(from, 0.008, 0.009)},
               {to - from - 0.001, 0, 0});
}

TEST(BladeCuts, WhatIsCutBeginsToOpenHalfAnIntervalAfterItsFirstLink) {
    BladedGrid grid;
    EXPECT_FALSE(grid.cuts.is_due(100));
    grid.sweep({Vector3(0.021, -0.01, 0.06), Vector3(0.021, 0.05, 0.06)}, {0, 0, -0.02}, 5);
    EXPECT_FALSE(grid.cuts.is_due(100)) << "above the grid's links";
    grid.sweep({Vector3(0.021, -0.01, 0.04), Vector3(0.021, 0.05, 0.04)}, {0, 0, -0.008}, 1);
    const double first_s = grid.time_s;
    EXPECT_FALSE(grid.cuts.is_due(first_s + 0.24));
    EXPECT_TRUE(grid.cuts.is_due(first_s + 0.26));
    grid.sweep({Vector3(0.021, -0.01, 0.033), Vector3(0.021, 0.05, 0.033)}, {0, 0, -0.012}, 2);
    EXPECT_FALSE(grid.cuts.is_due(first_s + 0.24)) << "later links do not put it off";
    EXPECT_TRUE(grid.cuts.is_due(first_s + 0.26));
    EXPECT_DOUBLE_EQ(grid.cuts.begin(), first_s + 0.5);
    EXPECT_FALSE(grid.cuts.is_due(first_s + 100)) << "it has begun";
    EXPECT_EQ(grid.cuts.parted(), 0U);
    const OpenedLevels opened = grid.cuts.open({grid.mesh});
    EXPECT_EQ(opened.nodes.originals.size(), 5U * 2);
    grid.cuts.keep();
    EXPECT_EQ(grid.cuts.parted(), 2U * 4);
    EXPECT_FALSE(grid.cuts.is_due(first_s + 100));
}

/// What blades cut while an opening is prepared waits for the next one, but for one that begins
/// once more.
TEST(BladeCuts, WhatIsCutMeanwhileOpensLater) {
    for (const bool restarts : {false, true}) {
        BladedGrid grid;
        grid.sweep({Vector3(0.021, -0.01, 0.046), Vector3(0.021, 0.05, 0.046)}, {0, 0, -0.012});
        const double opens_s = grid.cuts.begin();
        grid.sweep({Vector3(0.021, -0.01, 0.033), Vector3(0.021, 0.05, 0.033)}, {0, 0, -0.012}, 2);
        EXPECT_FALSE(grid.cuts.is_due(opens_s + 100));
        EXPECT_EQ(grid.cuts.open({grid.mesh}).nodes.originals.size(), 5U);
        if (restarts) {
            grid.cuts.restart();
            EXPECT_TRUE(grid.cuts.is_due(opens_s));
            EXPECT_DOUBLE_EQ(grid.cuts.begin(), opens_s);
            EXPECT_EQ(grid.cuts.open({grid.mesh}).nodes.originals.size(), 10U);
            continue;
        }
        grid.mesh = grid.opened();
        grid.cuts.keep();
        EXPECT_EQ(grid.cuts.parted(), 4U);
        EXPECT_FALSE(grid.cuts.is_due(grid.time_s + 0.1))
            << "its interval counts from its own first link";
        EXPECT_TRUE(grid.cuts.is_due(opens_s + 100));
        EXPECT_GT(grid.cuts.begin(), opens_s);
        EXPECT_EQ(grid.cuts.open({grid.mesh}).nodes.originals.size(), 5U);
        grid.cuts.keep();
        EXPECT_EQ(grid.cuts.parted(), 8U);
    }
}

TEST(BladeCuts, WhatIsUndoneIsNotCut) {
    BladedGrid grid;
    grid.sweep({Vector3(0.021, -0.01, 0.046), Vector3(0.021, 0.05, 0.046)}, {0, 0, -0.02});
    grid.cuts.begin();
    grid.mesh = grid.opened();
    grid.cuts.keep();
    grid.still.assign(grid.mesh.nodes.size(), Vector3::Zero());
    grid.sweep({Vector3(0.021, -0.01, 0.026), Vector3(0.021, 0.05, 0.026)}, {0, 0, -0.04});
    grid.cuts.begin();
    EXPECT_EQ(mesh_pieces(grid.opened()).size(), 2U);
    grid.cuts.undo();
    EXPECT_FALSE(grid.cuts.is_due(100));
    EXPECT_TRUE(grid.cuts.open({grid.mesh}).nodes.originals.empty());
    EXPECT_EQ(mesh_pieces(grid.opened()).size(), 1U);
}

/// All around the cell at a corner: it stays with a neighbour. A piece of two cells
/// does not.
TEST(BladeCuts, ASingleCellIsNotCutOff) {
    for (const bool two_cells : {false, true}) {
        BladedGrid grid;
        const double width = two_cells ? 0.021 : 0.009;
        cut_around_corner(grid, -0.002, width);
        const TetMesh opened = grid.opened();
        EXPECT_EQ(mesh_pieces(opened).size(), two_cells ? 2U : 1U);
        EXPECT_GT(opened.nodes.size(), grid.mesh.nodes.size()) << "the cut around it is made";
    }
}

/// A clock says whether an opening was prepared before it begins once more. What is cut does not
/// depend on it.
TEST(BladeCuts, WhatBeginsOnceMoreIsTheSameWhetherItWasPreparedOrNot) {
    std::vector<TetMesh> opened;
    for (const bool is_prepared : {false, true}) {
        BladedGrid grid;
        cut_around_corner(grid, -0.002, 0.009);  // a crumb
        grid.cuts.begin();
        if (is_prepared) (void)grid.opened();
        grid.cuts.restart();
        cut_around_corner(grid, 0.011, 0.021);  // its neighbour
        grid.cuts.begin();
        opened.push_back(grid.opened());
    }
    EXPECT_EQ(opened[0].hexahedra, opened[1].hexahedra);
    EXPECT_EQ(mesh_pieces(opened[0]).size(), 2U) << "the crumb hangs together with its neighbour";
}

/// Where the straight way of the blade is in the body.
TEST(BladeCuts, AGapInTheBodyIsCounted) {
    const auto gaps_from = [](double from, double to) {
        BladedGrid grid;
        for (const double z : {from, to}) {
            const std::optional<BladeEdge> edges[] = {
                BladeEdge{Vector3(0.021, -0.01, z), Vector3(0.021, 0.05, z)}};
            grid.cuts.follow(grid.time_s += 0.04, edges, grid.mesh, grid.still);
        }
        EXPECT_FALSE(grid.cuts.is_due(100)) << "nothing is cut";
        return grid.cuts.gaps();
    };
    EXPECT_EQ(gaps_from(0.035, 0.005).count, 1U);
    EXPECT_NEAR(gaps_from(0.035, 0.005).length, 0.03, 1e-12);
    for (const auto& [from, to] : {std::pair(0.06, 0.005), std::pair(0.005, 0.06)}) {
        EXPECT_EQ(gaps_from(from, to).count, 1U) << "it came from above, or left";
        EXPECT_NEAR(gaps_from(from, to).length, 0.035, 0.055 / 8);
    }
    EXPECT_EQ(gaps_from(0.06, 0.039).count, 0U) << "not as deep as a cell";
    EXPECT_EQ(gaps_from(0.06, -0.02).count, 1U) << "above, then below";
    EXPECT_EQ(gaps_from(0.06, 0.07).count, 0U) << "always above";
}

/// Far from the organ, or where the body has moved to without end: nothing is cut, nothing fails.
TEST(BladeCuts, ABladeFarAwayCutsNothing) {
    BladedGrid far, gone;
    far.sweep({Vector3(0.021, -900, 0.9), Vector3(0.021, -900.1, 0.9)}, {0, 0, -0.1});
    EXPECT_FALSE(far.cuts.is_due(1000));
    for (Vector3& u : gone.still) u.x() = 1e7;
    gone.sweep({Vector3(0.021, -0.01, 0.046), Vector3(0.021, 0.05, 0.046)}, {0, 0, -0.02});
    EXPECT_FALSE(gone.cuts.is_due(1000));
}

TEST(BladeCuts, CopiesJoinTheListsOfTheirOriginals) {
    std::vector<std::int32_t> nodes{2, 5, 9};
    add_copies(nodes, 10, std::vector<std::int32_t>{5, 3, 10, 2, 11});
    EXPECT_EQ(nodes, (std::vector<std::int32_t>{2, 5, 9, 10, 12, 13}))
        << "10 of 5, 12 of 10, 13 of 2";
    std::vector<double> values{0, 1, 2};
    copy_values(values, std::vector<std::int32_t>{2, 3, 0});
    EXPECT_EQ(values, (std::vector<double>{0, 1, 2, 2, 2, 0}));
}

}  // namespace
}  // namespace livetet
