// Grids of hexahedra from label maps of any shape.

#include "meshing/voxel_grid.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <numeric>

#include "base/error.hpp"
#include "mesh/hex_grid.hpp"

namespace livetet {
namespace {

/// Voxels of 1 x 1 x 1 mm with label_at(i, j, k).
LabelImage cube_of_labels(int n, const std::function<int(int, int, int)>& label_at) {
    LabelImage image{{n, n, n}, Eigen::Matrix4d::Identity(), {}};
    image.ras_from_voxel.topLeftCorner<3, 3>() *= 1e-3;
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) image.values.push_back(label_at(i, j, k));
    return image;
}

double volume_by_shares(const TetMesh& mesh) {
    return cell_volume(mesh) * std::accumulate(mesh.shares.begin(), mesh.shares.end(), 0.0);
}

const BodyChoice all_parts{Cavities::keep, Parts::all, 0.0};

/// However coarse the cells, their shares are the body's volume, and each mesh is a grid.
TEST(VoxelGrid, KeepsTheVolumeOfAnyShape) {
    const int n = 12;
    const std::pair<const char*, std::function<int(int, int, int)>> shapes[] = {
        {"checkerboard", [](int i, int j, int k) { return (i + j + k) % 2; }},
        {"sheet", [](int, int, int k) { return k == 5; }},
        {"thread", [](int, int j, int k) { return j == 7 && k == 3; }},
        {"one voxel", [](int i, int j, int k) { return i == 4 && j == 5 && k == 6; }},
        {"shell",
         [](int i, int j, int k) {
             const int d =
                 std::max({std::abs(2 * i - 11), std::abs(2 * j - 11), std::abs(2 * k - 11)});
             return d == 9;
         }},
        {"cube", [](int, int, int) { return 1; }}};
    for (const auto& [name, inside] : shapes) {
        const LabelImage image = cube_of_labels(n, inside);
        const auto voxels = std::accumulate(image.values.begin(), image.values.end(), 0);
        for (const int most : {100000, 200, 20, 1}) {
            const VoxelGrid grid = voxel_grid(image, {}, all_parts, most);
            check_tet_mesh(grid.mesh, name);
            (void)hex_level_of(grid.mesh, name);
            EXPECT_NEAR(volume_by_shares(grid.mesh), 1e-9 * voxels, 1e-15) << name << most;
            EXPECT_LE(grid.mesh.hexahedra.size(), static_cast<std::size_t>(most)) << name;
        }
    }
}

TEST(VoxelGrid, PutsCellsWhereTheVoxelsAre) {
    for (const bool mirrored : {false, true}) {
        LabelImage image = cube_of_labels(6, [](int i, int, int) { return i >= 2 ? 1 : 0; });
        if (mirrored) image.ras_from_voxel.col(0) *= -1;
        const VoxelGrid grid = voxel_grid(image, {}, {}, 1000);
        Vector3 low = grid.mesh.nodes[0], high = low;
        for (const Vector3& x : grid.mesh.nodes) low = low.cwiseMin(x), high = high.cwiseMax(x);
        const Vector3 from(mirrored ? -5.5e-3 : 1.5e-3, -0.5e-3, -0.5e-3),
            to(mirrored ? -1.5e-3 : 5.5e-3, 5.5e-3, 5.5e-3);
        EXPECT_LT((low - from).norm() + (high - to).norm(), 1e-12) << mirrored;
        EXPECT_EQ(grid.mesh.hexahedra.size(), 4U * 6 * 6);
    }
}

/// Thick slices: cells of 1 x 1 x 4 mm voxels are made of 4 x 4 (or, of less, 2 x 2) of them.
TEST(VoxelGrid, MakesNearlyEqualEdgesOfThickSlices) {
    LabelImage image = cube_of_labels(16, [](int, int, int) { return 1; });
    image.ras_from_voxel(2, 2) *= 4;
    const VoxelGrid grid = voxel_grid(image, {}, {}, 100000);
    EXPECT_EQ(grid.voxels_a_cell, (std::array<int, 3>{4, 4, 1}));
}

/// Two blocks in neighbouring coarse cells whose voxels do not touch share no nodes.
TEST(VoxelGrid, LinksCellsOnlyWhereVoxelsTouch) {
    const LabelImage image = cube_of_labels(8, [](int i, int j, int k) {
        if (i < 3) return 1;                          // touches x = 3 from below only at j < 1
        if (i == 3) return j == 0 && k == 0 ? 1 : 0;  // the bridge
        return i >= 4 ? 1 : 0;
    });
    const VoxelGrid grid = voxel_grid(image, {}, {}, 8);
    ASSERT_EQ(grid.voxels_a_cell, (std::array<int, 3>{4, 4, 4}));
    const HexLevel level = hex_level_of(grid.mesh, "grid");
    int across = 0;
    for (const HexLink& link : level.links) across += link.axis == 0;
    EXPECT_EQ(across, 1);
}

TEST(VoxelGrid, TakesTheLabelOfMostVoxels) {
    const LabelImage image = cube_of_labels(8, [](int i, int, int k) {
        return i < 3 ? 2 : k == 0 ? 0 : 5;
    });
    const VoxelGrid grid = voxel_grid(image, {}, {}, 8);
    const HexLevel level = hex_level_of(grid.mesh, "grid");
    ASSERT_EQ(grid.mesh.regions.size(), grid.mesh.tets.size());
    for (std::size_t e = 0; e < level.places.size(); ++e)
        EXPECT_EQ(grid.mesh.regions[6 * e], level.places[e][0] == 0 ? 2 : 5);
}

TEST(VoxelGrid, RefusesShearedAxes) {
    LabelImage image = cube_of_labels(4, [](int, int, int) { return 1; });
    image.ras_from_voxel(0, 1) = 0.1e-3;
    EXPECT_THROW((void)voxel_grid(image, {}, {}, 1000), Error);
}

}  // namespace
}  // namespace livetet
