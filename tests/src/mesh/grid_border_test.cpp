#include "mesh/grid_border.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mesh/body_motion.hpp"
#include "mesh/clipped_grid.hpp"
#include "mesh/hex_cut.hpp"
#include "mesh/quadratic_hexahedra.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

constexpr double radius = 7.3;

/// Of a cell of edge 1 at `low`, what of it is in the sphere about (8, 8, 8), by 8^3 points.
double share_in_sphere(const Vector3& low) {
    int inside = 0;
    for (int i = 0; i < 512; ++i) {
        const Vector3 x = low + Vector3(i % 8 + 0.5, i / 8 % 8 + 0.5, i / 64 + 0.5) / 8;
        inside += (x - Vector3::Constant(8)).norm() <= radius;
    }
    return inside / 512.0;
}

/// The sphere's grid of 16^3 cells, without empty ones.
TetMesh sphere() {
    TetMesh mesh = test::hex_grid({16, 16, 16}, {16, 16, 16}, [](const Vector3& middle) {
        return share_in_sphere(middle - Vector3::Constant(0.5)) > 0;
    });
    for (std::size_t e = 0; e < mesh.shares.size(); ++e)
        mesh.shares[e] = share_in_sphere(mesh.nodes[mesh.hexahedra[e][0]]);
    return mesh;
}

double distance_from_sphere(const Vector3& x) { return (x - Vector3::Constant(8)).norm() - radius; }

TEST(GridBorder, SolidCellsEndWithinACellOfTheSurface) {
    const TetMesh mesh = sphere();
    const std::vector<Triangle> faces = boundary_triangles(solid_tets(mesh));
    for (const std::int32_t n : nodes_of(faces))
        EXPECT_LT(std::abs(distance_from_sphere(mesh.nodes[n])), 1.0) << n;
    const std::vector<std::int32_t> border = border_nodes(mesh);
    // Those of the faces, and all outside of these.
    for (const std::int32_t n : nodes_of(faces))
        EXPECT_TRUE(std::ranges::binary_search(border, n)) << n;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        const bool is_border = std::ranges::binary_search(border, static_cast<std::int32_t>(n));
        const double outside = distance_from_sphere(mesh.nodes[n]);
        EXPECT_TRUE(is_border || outside < 0.9) << n;
        EXPECT_TRUE(!is_border || outside > -1.8) << n;
    }
}

TEST(GridBorder, ASheetOfNearlyEmptyCellsIsSolid) {
    TetMesh mesh = test::hex_grid({4, 4, 1}, {4, 4, 1});
    mesh.shares.assign(16, 0.2);
    EXPECT_EQ(solid_tets(mesh).size(), mesh.tets.size());
    EXPECT_EQ(border_nodes(mesh).size(), mesh.nodes.size());
    EXPECT_EQ(clipped_grid(mesh).tets.size(), mesh.tets.size());
}

TEST(GridBorder, OfOrderTwoTheTissueIsThatOfTheCellsAround) {
    TetMesh grid = test::hex_grid({2, 2, 2}, {2, 2, 2});
    for (std::size_t e = 0; e < 8; ++e) grid.shares[e] = 0.1 * static_cast<double>(e + 1);
    const TetMesh mesh = quadratic_grid(grid);
    const std::vector<double> tissue = tissue_around(mesh);
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        double sum = 0;  // of the cells whose closed box has the node
        int cells = 1;
        for (int d = 0; d < 3; ++d)
            if (std::abs(mesh.nodes[n][d] - std::round(mesh.nodes[n][d])) < 0.25) cells *= 2;
        for (std::size_t e = 0; e < 8; ++e)
            if ((mesh.nodes[n] - grid.nodes[grid.hexahedra[e][0]] - Vector3::Constant(0.5))
                    .cwiseAbs()
                    .maxCoeff() < 0.6)
                sum += grid.shares[e];
        EXPECT_NEAR(tissue[n], sum / cells, 1e-12) << mesh.nodes[n].transpose();
    }
}

/// The mean over eight cells draws a curved surface in a little, by 2 % of the volume here. Slits
/// add some percent to the area. It would double if no faces matched.
TEST(ClippedGrid, OfASphereIsASphere) {
    const TetMesh grid = sphere();
    for (const TetMesh& mesh : {grid, quadratic_grid(grid)}) {
        const BodyMotion motion =
            body_motion(mesh, std::vector<Vector3>(mesh.nodes.size(), Vector3::Zero()), 0);
        double volume = 0, area = 0, farthest = 0;
        for (const Tet& t : motion.tets) {
            volume += signed_volume(motion.rest, t);
            EXPECT_GT(signed_volume(motion.rest, t), 1e-6);
        }
        for (const auto& [a, b, c] : boundary_triangles(motion.tets)) {
            area += (motion.rest[b] - motion.rest[a]).cross(motion.rest[c] - motion.rest[a]).norm();
            for (const std::int32_t n : {a, b, c})
                farthest = std::max(farthest, std::abs(distance_from_sphere(motion.rest[n])));
        }
        const double ideal = 4 * std::numbers::pi * radius * radius;
        EXPECT_NEAR(volume, ideal * radius / 3, 0.025 * ideal * radius / 3);
        EXPECT_NEAR(area / 2, ideal, 0.1 * ideal);
        EXPECT_LT(farthest, 0.35);
    }
}

/// A plane through the cells at any height.
TEST(ClippedGrid, APlaneSurfaceIsThatPlane) {
    TetMesh mesh = test::hex_grid({6, 6, 3}, {6, 6, 3});
    for (std::size_t e = 0; e < mesh.shares.size(); ++e)
        if (mesh.nodes[mesh.hexahedra[e][0]].z() > 1.5) mesh.shares[e] = 0.3;
    const ClippedTets clipped = clipped_grid(mesh);
    int points = 0;
    for (const EdgePoint& p : clipped.points) {
        const Vector3 x = (1 - p.share) * mesh.nodes[p.a] + p.share * mesh.nodes[p.b];
        if (std::abs(x.x() - 3) > 1.9 || std::abs(x.y() - 3) > 1.9) continue;  // by the sides
        EXPECT_NEAR(x.z(), 2.3, 1e-12);
        ++points;
    }
    EXPECT_GT(points, 20);
}

/// Of a block with partly filled cells.
TEST(ClippedGrid, BothSidesOfACutEndAtTheSamePlaces) {
    TetMesh whole = test::hex_grid({4, 4, 4}, {4, 4, 4});
    for (std::size_t e = 0; e < whole.shares.size(); ++e)
        if (whole.nodes[whole.hexahedra[e][0]].z() > 2.5) whole.shares[e] = 0.6;
    const HexLevel level = hex_level_of(whole, "grid");
    const TetMesh mesh = without_links(
        whole, level,
        crossed_links(level, grid_frame(whole, level), PlanePatch{{2, 0, 0}, {1, 0, 0}}, "cut"));
    const std::vector<Vector3> still(mesh.nodes.size(), Vector3::Zero());
    // The cut's faces lie on each other, so that no rind is between them: as many as without it.
    const auto rind = [](const TetMesh& m, const std::vector<Vector3>& u) {
        const BodyMotion motion = body_motion(m, u, 0.25);
        return motion.tets.size() - motion.own;
    };
    EXPECT_EQ(rind(mesh, still),
              rind(whole, std::vector<Vector3>(whole.nodes.size(), Vector3::Zero())));
    EXPECT_EQ(clipped_grid(mesh).tets.size(), clipped_grid(whole).tets.size());
}

}  // namespace
}  // namespace livetet
