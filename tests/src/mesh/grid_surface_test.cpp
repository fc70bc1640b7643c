// The smoothed border of a grid.

#include "mesh/grid_surface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mesh/hex_cut.hpp"
#include "mesh/surface_patch.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

TEST(GridSurface, LeavesABlockButForItsEdges) {
    const TetMesh grid = test::hex_grid({20, 20, 8}, {0.2, 0.2, 0.08});
    const auto places = smoothed_surface(grid, boundary_triangles(grid.tets));
    for (std::size_t n = 0; n < places.size(); ++n) {
        const Vector3& x = grid.nodes[n];
        EXPECT_LE((places[n] - x).lpNorm<Eigen::Infinity>(), 0.005 + 1e-12);
        const auto on_border = [](double c, double size) { return c < 1e-9 || c > size - 1e-9; };
        const bool inside =
            !on_border(x.x(), 0.2) && !on_border(x.y(), 0.2) && !on_border(x.z(), 0.08);
        // The edges' rounding does not reach the middle of the top.
        const bool middle = (x - Vector3(0.1, 0.1, 0.08)).norm() < 0.005;
        if (inside || middle) {
            EXPECT_LT((places[n] - x).norm(), 1e-12);
        }
    }
}

/// On a ball of 60 cells across, a patch has the area of the sphere's cap, whichever way it faces.
TEST(GridSurface, PatchesOnABallAreCaps) {
    constexpr double radius = 0.05, patch_radius = 0.015;
    const TetMesh grid = test::hex_grid({60, 60, 60}, {0.12, 0.12, 0.12}, [](const Vector3& x) {
        return (x - Vector3::Constant(0.06)).norm() < radius;
    });
    const double cap =
        2 * std::numbers::pi * radius * radius * (1 - std::cos(patch_radius / radius));
    for (const Vector3& way : {Vector3(0, 0, 1), Vector3(1, 1, 0), Vector3(1, 1, 1),
                               Vector3(3, 1, 0), Vector3(5, 3, 1)}) {
        const Vector3 outwards = way.normalized();
        const SurfacePatch patch =
            surface_patch(grid, Vector3::Constant(0.06) + radius * outwards, patch_radius);
        EXPECT_NEAR(patch.area / cap, 1, 0.05) << way.transpose();
        EXPECT_NEAR(patch.disc_area / cap, 1, 0.05) << way.transpose();
        EXPECT_GT(patch.normal.dot(outwards), 0.99) << way.transpose();
        // The patch's farthest node is as far as the disc's border, in a straight line.
        double farthest = 0;
        for (const std::int32_t n : patch.nodes)
            farthest = std::max(farthest, (grid.nodes[n] - patch.at).norm());
        EXPECT_NEAR(farthest, patch_radius, 0.003) << way.transpose();
    }
}

/// The sides of a cut take the places that the nodes have without it: at rest nothing gapes.
TEST(GridSurface, ClosesACutAtRest) {
    const TetMesh ball = test::hex_grid({12, 12, 12}, {0.06, 0.06, 0.06}, [](const Vector3& x) {
        return (x - Vector3::Constant(0.03)).norm() < 0.025;
    });
    const HexLevel level = hex_level_of(ball, "ball");
    std::vector<std::uint8_t> cut;  // half through
    for (const HexLink& link : level.links) {
        const HexPlace& lower = level.places[link.lower];
        cut.push_back(link.axis == 0 && lower[0] == 5 && lower[1] < 6);
    }
    const OpenedGrid opened = open_links(ball, level, cut);
    ASSERT_GT(opened.originals.size(), 20);
    const auto whole = smoothed_surface(ball, boundary_triangles(ball.tets));
    const auto places = smoothed_surface(opened.mesh, boundary_triangles(opened.mesh.tets));
    for (std::size_t n = 0; n < places.size(); ++n) {
        const std::size_t count = ball.nodes.size();
        const std::size_t original = n < count ? n : opened.originals[n - count];
        EXPECT_LT((places[n] - whole[original]).norm(), 1e-15) << n;
    }
}

}  // namespace
}  // namespace livetet
