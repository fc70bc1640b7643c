// Grids of hexahedra: their nodes, links and nested levels.

#include "mesh/hex_grid.hpp"

#include <gtest/gtest.h>

#include <set>

#include "base/error.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

std::string refusal_of(const TetMesh& mesh) {
    try {
        (void)hex_level_of(mesh, "grid.h5");
    } catch (const Error& e) {
        return e.what();
    }
    return {};
}

TEST(HexGrid, HasTetsThatFillItsCellsAndMeetFaceToFace) {
    const TetMesh mesh = test::hex_grid({3, 2, 2}, {0.3, 0.1, 0.2});
    check_tet_mesh(mesh, "grid");
    EXPECT_NEAR(volume(mesh), 0.3 * 0.1 * 0.2, 1e-15);
    EXPECT_NEAR(cell_volume(mesh), volume(mesh) / 12, 1e-16);
    // Two triangles a face of the box: inner faces cancel only where neighbours agree.
    EXPECT_EQ(boundary_triangles(mesh.tets).size(), 2U * 2 * (3 * 2 + 3 * 2 + 2 * 2));
}

TEST(HexGrid, ReadsItsPlacesAndLinksFromTheNodes) {
    const TetMesh mesh = test::hex_grid({4, 3, 2}, {0.4, 0.3, 0.2});
    const HexLevel level = hex_level_of(mesh, "grid");
    EXPECT_EQ(level.links.size(), 3U * 3 * 2 + 4 * 2 * 2 + 4 * 3 * 1);
    EXPECT_EQ(level.places.back(), (HexPlace{3, 2, 1}));
}

TEST(HexGrid, NumbersNodesAlongRowsThenFromLayerToLayer) {
    const TetMesh mesh = test::hex_grid({4, 3, 2}, {0.4, 0.3, 0.2}, [](const Vector3& x) {
        return x.x() > 0.1 || x.y() > 0.1;  // a row that starts later
    });
    for (std::size_t n = 1; n < mesh.nodes.size(); ++n) {
        const Vector3 step = mesh.nodes[n] - mesh.nodes[n - 1];
        EXPECT_TRUE(step.z() > 1e-9 ||
                    (step.z() > -1e-9 && (step.y() > 1e-9 || (step.y() > -1e-9 && step.x() > 0))))
            << n;
    }
    EXPECT_EQ(mesh.nodes.front(), Vector3(0.1, 0, 0));
}

/// Cells of a checkerboard touch at edges only: no two hang together.
TEST(HexGrid, LeavesCellsApartThatTouchAtAnEdge) {
    const TetMesh mesh = test::hex_grid({4, 4, 4}, {4, 4, 4}, [](const Vector3& x) {
        return (static_cast<int>(x[0]) + static_cast<int>(x[1]) + static_cast<int>(x[2])) % 2 == 0;
    });
    EXPECT_EQ(mesh.nodes.size(), 8 * mesh.hexahedra.size());
    EXPECT_EQ(hex_levels(mesh, 1).size(), 1U);  // nothing that a coarser level could join
}

/// Two plates with a gap of one cell, joined at one end: every coarser level keeps them apart where
/// the gap is, although one coarse cell covers both.
TEST(HexGrid, KeepsPartsApartAcrossAGapOnEachLevel) {
    const TetMesh mesh = test::hex_grid(
        {16, 4, 3}, {16, 4, 3}, [](const Vector3& x) { return x[2] < 1 || x[2] > 2 || x[0] < 2; });
    std::vector<HexLevel> levels = hex_levels(mesh, 1);
    ASSERT_GE(levels.size(), 2U);
    const HexLevel& coarse = levels[1];
    std::map<HexPlace, int> cells;
    for (const HexPlace& place : coarse.places) ++cells[place];
    EXPECT_EQ((cells[{0, 0, 0}]), 1);  // the joint
    std::set<std::int32_t> lower, upper;
    for (std::size_t e = 0; e < levels[0].cells.size(); ++e) {
        const HexPlace& p = levels[0].places[e];
        if (p[0] < 4) continue;
        const Hexahedron& parent = coarse.cells[levels[0].parents[e]];
        (p[2] == 0 ? lower : upper).insert(parent.begin(), parent.end());
    }
    for (const std::int32_t n : lower) EXPECT_FALSE(upper.contains(n));
}

/// A fine node has the same coarse nodes and weights from whichever of its cells.
TEST(HexGrid, InterpolatesLinearFieldsAlikeFromEachCell) {
    const TetMesh mesh = test::hex_grid({8, 8, 8}, {8, 8, 8}, [](const Vector3& x) {
        return (x - Vector3(4, 4, 4)).norm() < 4.3 && !(x[0] > 3 && x[0] < 4 && x[1] > 2);
    });
    std::vector<HexLevel> levels = hex_levels(mesh, 1);
    ASSERT_GE(levels.size(), 2U);
    for (std::size_t l = 0; l + 1 < levels.size(); ++l) {
        const HexLevel &fine = levels[l], &coarse = levels[l + 1];
        std::map<std::int32_t, std::map<std::int32_t, double>> rows;
        for (std::size_t e = 0; e < fine.cells.size(); ++e)
            for (int c = 0; c < 8; ++c) {
                std::map<std::int32_t, double> row;
                for (int C = 0; C < 8; ++C) {
                    double w = 1;
                    for (int d = 0; d < 3; ++d) {
                        const double x = ((fine.places[e][d] & 1) + (c >> d & 1)) / 2.0;
                        w *= C >> d & 1 ? x : 1 - x;
                    }
                    if (w > 0) row[coarse.cells[fine.parents[e]][C]] += w;
                }
                const auto [found, fresh] = rows.try_emplace(fine.cells[e][c], row);
                ASSERT_EQ(found->second, row) << "level " << l << ", node " << fine.cells[e][c];
            }
    }
}

TEST(HexGrid, RefusesWhatIsNoGrid) {
    TetMesh moved = test::hex_grid({2, 1, 1}, {2, 1, 1});
    moved.nodes[moved.hexahedra[1][7]].x() += 0.1;
    EXPECT_NE(refusal_of(moved).find("hexahedron 1"), std::string::npos) << refusal_of(moved);
    TetMesh flat = test::hex_grid({1, 1, 1}, {1, 1, 1});
    for (Vector3& x : flat.nodes) x.z() = 0;
    EXPECT_NE(refusal_of(flat).find("volume of 0"), std::string::npos) << refusal_of(flat);
    TetMesh named = test::hex_grid({1, 1, 1}, {1, 1, 1});
    named.hexahedra[0][3] = 8;
    EXPECT_NE(refusal_of(named).find("names node 8"), std::string::npos) << refusal_of(named);
    for (const double share : {0.0, 1.5, std::nan("")}) {
        TetMesh shared = test::hex_grid({1, 1, 1}, {1, 1, 1});
        shared.shares[0] = share;
        EXPECT_NE(refusal_of(shared).find("share"), std::string::npos) << refusal_of(shared);
    }
    TetMesh lost = test::hex_grid({1, 1, 1}, {1, 1, 1});
    lost.nodes[5].y() = std::nan("");
    EXPECT_NE(refusal_of(lost).find("not finite"), std::string::npos) << refusal_of(lost);
}

}  // namespace
}  // namespace livetet
