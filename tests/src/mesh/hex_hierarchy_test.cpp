// The coarser levels of a grid as meshes.

#include "mesh/hex_hierarchy.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "mesh/hex_cut.hpp"
#include "mesh/hex_transfer.hpp"
#include "mesh/mesh_pieces.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

/// A ball of cells in two regions, some of them border cells.
TetMesh ball() {
    TetMesh mesh = test::hex_grid({13, 12, 11}, {0.13, 0.12, 0.11}, [](const Vector3& x) {
        return (x - Vector3(0.06, 0.06, 0.055)).norm() < 0.05;
    });
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e) {
        mesh.shares[e] = e % 3 == 0 ? 0.5 : 1;
        const int region = mesh.nodes[mesh.hexahedra[e][0]].x() < 0.055 ? 4 : 9;
        mesh.regions.insert(mesh.regions.end(), tets_per_hexahedron, region);
    }
    return mesh;
}

double body_volume(const TetMesh& mesh) {
    return cell_volume(mesh) * std::accumulate(mesh.shares.begin(), mesh.shares.end(), 0.0);
}

TEST(GridHierarchy, LevelsAreMeshesOfTheSameBody) {
    const GridHierarchy made = grid_hierarchy(ball(), 20);
    ASSERT_GE(made.levels.size(), 3);
    ASSERT_EQ(made.meshes.levels.size(), made.levels.size());
    ASSERT_NO_THROW(check_hierarchy(made.meshes));
    const double volume = body_volume(made.meshes.levels.front());
    for (const TetMesh& mesh : made.meshes.levels) {
        EXPECT_NEAR(body_volume(mesh), volume, 1e-12 * volume);
        ASSERT_EQ(mesh.regions.size(), mesh.tets.size());
        EXPECT_EQ(hex_level_of(mesh, "a level").cells.size(), mesh.hexahedra.size());
        // The regions meet at one plane: cells on either side of it are theirs.
        for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e) {
            const double low = mesh.nodes[mesh.hexahedra[e][0]].x(),
                         high = mesh.nodes[mesh.hexahedra[e][1]].x();
            if (high < 0.0601) {
                EXPECT_EQ(mesh.regions[tets_per_hexahedron * e], 4);
            }
            if (low > 0.0599) {
                EXPECT_EQ(mesh.regions[tets_per_hexahedron * e], 9);
            }
        }
    }
}

/// Both transfers take a linear function of the coarse nodes to that of the fine ones.
TEST(GridHierarchy, TransfersReproduceLinearFunctions) {
    const GridHierarchy made = grid_hierarchy(ball(), 20);
    const auto value = [](const Vector3& x) { return 3 * x.x() - 2 * x.y() + x.z() + 0.1; };
    for (std::size_t l = 0; l + 1 < made.levels.size(); ++l) {
        const TetMesh &fine = made.meshes.levels[l], &coarse = made.meshes.levels[l + 1];
        const BarycentricMap& map = made.meshes.transfers[l];
        const auto from = places_in_coarser(made.levels[l]);
        ASSERT_EQ(map.size(), fine.nodes.size());
        for (std::size_t n = 0; n < fine.nodes.size(); ++n) {
            double by_tets = 0, trilinear = 0;
            for (int k = 0; k < 4; ++k) {
                EXPECT_GE(map.weights[n][k], 0);
                by_tets += map.weights[n][k] * value(coarse.nodes[map.nodes[n][k]]);
            }
            const Hexahedron& cell = coarse.hexahedra[from[n] / places_in_parent];
            for (int c = 0; c < 8; ++c)
                trilinear += corner_values_at_places()[from[n] % places_in_parent][c] *
                             value(coarse.nodes[cell[c]]);
            ASSERT_NEAR(by_tets, value(fine.nodes[n]), 1e-12) << l << ", " << n;
            ASSERT_NEAR(trilinear, value(fine.nodes[n]), 1e-12) << l << ", " << n;
        }
    }
}

/// A block cut in two: no coarse node serves both sides.
TEST(GridHierarchy, NoTransferCrossesACut) {
    const TetMesh whole = test::hex_grid({8, 8, 8}, {0.08, 0.08, 0.08});
    const HexLevel level = hex_level_of(whole, "a block");
    const PlanePatch plane{.point = {0.03, 0, 0}, .normal = Vector3::UnitX()};
    const GridHierarchy made = grid_hierarchy(
        without_links(whole, level, crossed_links(level, grid_frame(whole, level), plane, "")), 4);
    ASSERT_GE(made.levels.size(), 3);
    for (std::size_t l = 0; l + 1 < made.levels.size(); ++l) {
        // Sides by connected pieces, for cells on both sides may be at one place.
        const auto side_of = [](const TetMesh& mesh) {
            std::vector<int> side(mesh.nodes.size(), -1);
            const auto pieces = mesh_pieces(mesh);
            EXPECT_EQ(pieces.size(), 2);
            for (std::size_t p = 0; p < pieces.size(); ++p)
                for (const std::int32_t e : pieces[p].cells)
                    for (const std::int32_t n : mesh.hexahedra[e]) side[n] = static_cast<int>(p);
            return side;
        };
        const auto fine = side_of(made.meshes.levels[l]),
                   coarse = side_of(made.meshes.levels[l + 1]);
        const BarycentricMap& map = made.meshes.transfers[l];
        for (std::size_t n = 0; n < fine.size(); ++n)
            for (int k = 0; k < 4; ++k)
                if (map.weights[n][k] != 0) {
                    ASSERT_EQ(coarse[map.nodes[n][k]], fine[n]) << l;
                }
    }
}

}  // namespace
}  // namespace livetet
