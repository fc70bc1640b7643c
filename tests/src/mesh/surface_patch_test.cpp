#include "mesh/surface_patch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "mesh/quadratic.hpp"
#include "mesh/shapes.hpp"

namespace livetet {
namespace {

constexpr double side = 0.096, thickness = 0.001, edge = 0.008;

/// A plate whose upper nodes are above the centres between the lower ones.
TetMesh plate() {
    TetMesh mesh = shapes::box({side, side, thickness}, {12, 12, 1});
    for (Vector3& x : mesh.nodes)
        x.head<2>() += Vector3(edge, edge, 0).head<2>() / 2 * (x.z() / thickness);
    return mesh;
}

TEST(SurfacePatch, does_not_go_through_a_plate_to_its_other_side) {
    const TetMesh mesh = plate();
    const SurfacePatch above = surface_patch(mesh, {0.05, 0.05, 0.003}, 0.02);
    EXPECT_GT(above.nodes.size(), 12u);
    for (const std::int32_t n : above.nodes) EXPECT_EQ(mesh.nodes[n].z(), thickness);
    const SurfacePatch below = surface_patch(mesh, {0.05, 0.05, -0.003}, 0.02);
    EXPECT_GT(below.nodes.size(), 12u);
    for (const std::int32_t n : below.nodes) EXPECT_EQ(mesh.nodes[n].z(), 0);
}

/// Directly above a lower node, which is the nearest node (1.5 mm against 5.7 mm).
TEST(SurfacePatch, has_its_centre_on_the_side_of_the_place) {
    const TetMesh mesh = plate();
    const Vector3 place(6 * edge, 6 * edge, thickness + 0.0005);
    const SurfacePatch patch = surface_patch(mesh, place, 0.015);
    EXPECT_EQ(mesh.nodes[patch.centre].z(), thickness);
    EXPECT_TRUE(std::binary_search(patch.nodes.begin(), patch.nodes.end(), patch.centre));
    EXPECT_NEAR(patch.distance, 0.0005, 1e-12);
    for (const std::int32_t n : patch.nodes) EXPECT_EQ(mesh.nodes[n].z(), thickness);
}

/// Near the rim the other side is near in space, but far along the surface.
TEST(SurfacePatch, measures_along_the_surface) {
    const TetMesh mesh = plate();
    const Vector3 place(side - edge, 0.05, thickness + 0.001);  // 12 mm from the upper rim
    const SurfacePatch patch = surface_patch(mesh, place, 0.02);
    for (const std::int32_t n : patch.nodes)
        if (mesh.nodes[n].z() == 0) {
            EXPECT_GE(mesh.nodes[n].x(), side - 1.01 * edge) << "round the rim there are 8 mm left";
        }
    EXPECT_GT(patch.nodes.size(), 8u);
}

/// If the radius reaches the rim, the patch may go around it.
TEST(SurfacePatch, goes_round_a_rim_as_far_as_the_radius_goes) {
    const TetMesh mesh = plate();
    const SurfacePatch patch = surface_patch(mesh, {side + 0.004, 0.05, thickness + 0.001}, 0.02);
    const auto lower = std::count_if(patch.nodes.begin(), patch.nodes.end(),
                                     [&](std::int32_t n) { return mesh.nodes[n].z() == 0; });
    EXPECT_GT(lower, 0);
    EXPECT_LT(lower, std::ssize(patch.nodes) - lower);
}

/// A quarter of an edge beside a node, the patch moves with the place, not with the node.
TEST(SurfacePatch, lies_about_the_place_and_not_about_a_node) {
    constexpr int cells = 40;
    const TetMesh mesh = shapes::box({0.2, 0.2, 0.01}, {cells, cells, 1});
    const double cell = 0.2 / cells;
    for (const double beside : {0., 0.25, 0.45}) {
        const Vector3 place(0.1 + beside * cell, 0.1, 0.01);
        const SurfacePatch patch = surface_patch(mesh, place, 0.0155);
        double farthest = 0, nearest = 1;  // of those in the patch, and of the others
        for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
            const bool in = std::ranges::binary_search(patch.nodes, static_cast<std::int32_t>(n));
            const double distance = (mesh.nodes[n] - place).norm();
            if (mesh.nodes[n].z() < 0.005)
                EXPECT_FALSE(in);
            else if (in)
                farthest = std::max(farthest, distance);
            else
                nearest = std::min(nearest, distance);
        }
        EXPECT_LT(farthest, 1.02 * nearest) << "the nearest nodes, to what distances are known";
        EXPECT_GT(farthest, 0.0145);
        EXPECT_LT(farthest, 0.0155 + cell);
        EXPECT_LT(patch.off_centre.norm(), 0.4 * cell);
    }
}

/// As many nodes as hold the disc's area: triangles with all corners in the patch, and a sixth of
/// the others for each corner. The middles of edges of ten-node tets are corners, too.
TEST(SurfacePatch, holds_the_area_of_the_disc) {
    const TetMesh four = shapes::box({0.2, 0.2, 0.01}, {40, 40, 1}),
                  ten = quadratic_mesh(shapes::box({0.2, 0.2, 0.01}, {20, 20, 1}));
    for (const double radius : {0.012, 0.015, 0.0187, 0.03}) {
        const SurfacePatch patch = surface_patch(four, {0.1013, 0.0988, 0.01}, radius);
        const double disc = std::numbers::pi * radius * radius;
        EXPECT_NEAR(patch.disc_area, disc, 0.02 * disc);
        EXPECT_NEAR(patch.area, patch.disc_area, 2.5e-5) << "one cell";
        double held = 0;
        for (const Triangle& t : boundary_triangles(four.tets)) {
            const auto corners = std::ranges::count_if(
                t, [&](std::int32_t n) { return std::ranges::binary_search(patch.nodes, n); });
            const double area = (four.nodes[t[1]] - four.nodes[t[0]])
                                    .cross(four.nodes[t[2]] - four.nodes[t[0]])
                                    .norm() /
                                2;
            held += (corners == 3 ? 1 : static_cast<double>(corners) / 6) * area;
        }
        EXPECT_NEAR(patch.area, held, 1e-12);
        const SurfacePatch of_ten = surface_patch(ten, {0.1013, 0.0988, 0.01}, radius);
        EXPECT_NEAR(of_ten.area, of_ten.disc_area, 2.5e-5);
        EXPECT_NEAR(static_cast<double>(of_ten.nodes.size()),
                    static_cast<double>(patch.nodes.size()), 0.2 * patch.nodes.size());
    }
}

TEST(SurfacePatch, of_one_place_with_several_radii_are_those_taken_one_by_one) {
    const TetMesh mesh = plate();
    const Vector3 place(0.05, 0.04, thickness + 0.002);
    const SurfaceNeighbourhood around(mesh, place);
    for (const double radius : {0.03, 0.01, 0.02}) {
        const SurfacePatch alone = surface_patch(mesh, place, radius),
                           shared = around.patch(radius);
        EXPECT_EQ(shared.nodes, alone.nodes);
        EXPECT_EQ(shared.area, alone.area);
        EXPECT_EQ(shared.off_centre, alone.off_centre);
        EXPECT_NEAR(shared.distance, 0.002, 1e-12);
    }
    EXPECT_LT(around.patch(0.01).nodes.size(), around.patch(0.03).nodes.size());
}

TEST(SurfacePatch, is_a_single_node_where_the_radius_reaches_none) {
    const TetMesh mesh = plate();
    const Vector3 place(6.4 * edge, 6.3 * edge, thickness);
    const SurfacePatch patch = surface_patch(mesh, place, 1e-4);
    ASSERT_EQ(patch.nodes, std::vector{patch.centre});
    EXPECT_LT((place + patch.off_centre - mesh.nodes[patch.centre]).norm(), 1e-12);
}

}  // namespace
}  // namespace livetet
