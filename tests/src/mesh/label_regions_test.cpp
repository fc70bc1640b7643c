#include "mesh/label_regions.hpp"

#include <gtest/gtest.h>

#include "support/shapes.hpp"

namespace livetet {
namespace {

/// 10 x 10 x 10 voxels of 10 mm, label 1 below x = 50 mm and 2 above, 0 in the outermost layer.
LabelImage halves() {
    LabelImage image;
    image.size = {10, 10, 10};
    image.ras_from_voxel.diagonal() << 0.01, 0.01, 0.01, 1;
    image.ras_from_voxel.topRightCorner<3, 1>().setConstant(0.005);
    image.values.assign(1000, 0);
    for (int k = 1; k < 9; ++k)
        for (int j = 1; j < 9; ++j)
            for (int i = 1; i < 9; ++i) image.at(i, j, k) = i < 5 ? 1 : 2;
    return image;
}

TEST(RegionsByLabel, AreThoseOfTheNearestVoxelOfTheBody) {
    const TetMesh mesh = test::block({10, 10, 10}, {0.1, 0.1, 0.1});
    const auto regions = regions_by_label(mesh, halves(), {});
    ASSERT_EQ(regions.size(), mesh.tets.size());
    for (std::size_t e = 0; e < regions.size(); ++e) {
        double x = 0;
        for (const std::int32_t n : mesh.tets[e]) x += mesh.nodes[n].x() / 4;
        EXPECT_EQ(regions[e], x < 0.05 ? 1 : 2) << x;
    }
}

TEST(RegionsByLabel, OneLabelIsEverywhereAndNoneNowhere) {
    const TetMesh mesh = test::block({2, 2, 2}, {0.1, 0.1, 0.1});
    EXPECT_EQ(regions_by_label(mesh, halves(), std::vector{2}), std::vector<std::int32_t>(mesh.tets.size(), 2));
    EXPECT_TRUE(regions_by_label(mesh, halves(), std::vector{7}).empty());
}

}  // namespace
}  // namespace livetet
