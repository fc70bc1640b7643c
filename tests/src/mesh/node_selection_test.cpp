#include "image/mask_selection.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "base/error.hpp"
#include "mesh/shapes.hpp"

namespace livetet {
namespace {

const TetMesh box = shapes::box({0.1, 0.1, 0.1}, {5, 5, 5});  // nodes every 20 mm

TEST(NodeSelection, takes_a_node_by_its_nearest_voxel) {
    // Voxels of 20 mm centred on the nodes, x mirrored and shifted: voxel i is at x = 0.1 - 0.02 i.
    LabelImage mask{{6, 6, 6}, Eigen::Matrix4d::Identity(), std::vector<std::int32_t>(216, 0)};
    mask.ras_from_voxel.diagonal() << -0.02, 0.02, 0.02, 1;
    mask.ras_from_voxel(0, 3) = 0.1;
    mask.at(1, 2, 3) = 5;
    mask.at(0, 0, 5) = -1;
    std::vector<std::int32_t> expected{4 + 6 * (2 + 6 * 3), 5 + 6 * (0 + 6 * 5)};
    EXPECT_EQ(nodes_in_mask(box, mask), expected);
    EXPECT_EQ(nodes_in_mask(box, mask, NodeScope::surface_only),
              std::vector<std::int32_t>{expected[1]});
    mask.ras_from_voxel(0, 3) += 0.009;  // less than half a voxel: the same nodes
    EXPECT_EQ(nodes_in_mask(box, mask), expected);
    mask.ras_from_voxel(0, 3) += 0.002;  // more than half: the next ones
    expected = {5 + 6 * (2 + 6 * 3)};
    EXPECT_EQ(nodes_in_mask(box, mask), expected);
}

TEST(NodeSelection, leaves_out_nodes_beyond_the_image) {
    LabelImage mask{{2, 2, 2}, Eigen::Matrix4d::Identity(), std::vector<std::int32_t>(8, 1)};
    mask.ras_from_voxel.diagonal() << 0.02, 0.02, 0.02, 1;
    EXPECT_EQ(nodes_in_mask(box, mask).size(), 8u);
    mask.ras_from_voxel(0, 0) = 0;
    EXPECT_THROW(nodes_in_mask(box, mask), Error);
}

TEST(NodeSelection, box_sphere_and_half_space_take_their_borders) {
    // Exactly that of the second layer of nodes.
    const Vector3 corner(0.1, 0.1, box.nodes[36].z());
    EXPECT_EQ(nodes_in_box(box, {0, 0, 0}, corner).size(), 72u);
    EXPECT_EQ(nodes_in_box(box, {0, 0, 0}, corner, NodeScope::surface_only).size(), 72u - 16u);
    EXPECT_EQ(nodes_in_sphere(box, box.nodes[0], 0.0200001).size(), 4u);
    EXPECT_EQ(nodes_in_sphere(box, box.nodes[0], 0).size(), 1u);
    const std::vector<std::int32_t> low = nodes_in_half_space(box, {0, 0, 0.03}, {0, 0, 5});
    EXPECT_EQ(low.size(), 72u);
    for (const std::int32_t n : low) EXPECT_LT(box.nodes[n].z(), 0.03);
    EXPECT_TRUE(std::is_sorted(low.begin(), low.end()));
    EXPECT_EQ(nodes_in_half_space(box, {0, 0, 0}, {0, 0, 1}).size(), 36u);
}

TEST(NodeSelection, refuses_shapes_without_sense) {
    EXPECT_THROW(nodes_in_box(box, {1, 0, 0}, {0, 1, 1}), Error);
    EXPECT_THROW(nodes_in_sphere(box, {0, 0, 0}, -1), Error);
    EXPECT_THROW(nodes_in_sphere(box, {0, 0, 0}, std::nan("")), Error);
    EXPECT_THROW(nodes_in_half_space(box, {0, 0, 0}, {0, 0, 0}), Error);
}

}  // namespace
}  // namespace livetet
