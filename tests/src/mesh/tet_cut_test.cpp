// Cuts of tets: what is parted, places, volumes, angles, sets; transfers between cut levels.

#include "mesh/tet_cut.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <numbers>
#include <random>

#include "base/error.hpp"
#include "mesh/cut_hierarchy.hpp"
#include "mesh/least_dihedral.hpp"
#include "mesh/mesh_pieces.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

const Vector3 unit_sides(1, 1, 1);

CutTets tets_cut_by(const TetMesh& mesh, const CutSurface& surface) {
    return cut_tets(mesh, SegmentCrossings(surface, mesh.nodes, "cut"));
}

double least_angle_deg(const TetMesh& mesh) {
    double least = std::numbers::pi;
    for (const Tet& t : mesh.tets) least = std::min(least, least_dihedral(mesh.nodes, t));
    return least * 180 / std::numbers::pi;
}

/// A plane's square about a point, 4 m wide, as `n` x `n` x 2 triangles.
TriangleMesh sheet(const Vector3& middle, const Vector3& a, const Vector3& b, int n) {
    TriangleMesh surface;
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i)
            surface.nodes.push_back(middle + (4.0 * i / n - 2) * a + (4.0 * j / n - 2) * b);
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            const int first = i + (n + 1) * j, above = first + n + 1;
            surface.triangles.push_back({first, first + 1, above});
            surface.triangles.push_back({first + 1, above + 1, above});
        }
    return surface;
}

/// A plane along faces of the mesh: but for rounding no node moves, no edge is split, and the faces
/// open.
TEST(TetCut, APlaneAlongFacesOpensThem) {
    const TetMesh box = test::block({4, 4, 4}, unit_sides);
    const CutTets cut = tets_cut_by(box, PlanePatch{{0.5, 0, 0}, {1, 0, 0}});
    EXPECT_EQ(cut.counts.added, 0U);
    EXPECT_EQ(cut.counts.doubled, 25U);
    for (std::size_t n = 0; n < box.nodes.size(); ++n)
        EXPECT_LT((cut.mesh.nodes[n] - box.nodes[n]).norm(), 1e-11);
    const auto pieces = mesh_pieces(cut.mesh);
    ASSERT_EQ(pieces.size(), 2U);
    EXPECT_NEAR(pieces[0].volume, 0.5, 1e-11);
    EXPECT_EQ(boundary_triangles(cut.mesh.tets).size(), boundary_triangles(box.tets).size() + 64);
}

TEST(TetCut, PlanesInAnyDirectionPartABoxInTwo) {
    const TetMesh box = test::block({6, 6, 6}, unit_sides);
    std::mt19937 random(1);
    std::normal_distribution<double> any;
    for (int k = 0; k < 30; ++k) {
        const PlanePatch plane{{0.47, 0.52, 0.5}, {any(random), any(random), any(random)}};
        const CutTets cut = tets_cut_by(box, plane);
        check_tet_mesh(cut.mesh, "cut");
        EXPECT_GT(least_angle_deg(cut.mesh), 5) << k;
        EXPECT_NEAR(volume(cut.mesh), 1, 0.01) << k;
        const auto pieces = mesh_pieces(cut.mesh);
        ASSERT_EQ(pieces.size(), 2U) << k;
        // Each piece is on its own side, but for what passes beside the surface.
        const Vector3 normal = plane.normal.normalized();
        for (const MeshPiece& piece : pieces) {
            const double own = (piece.centroid - plane.point).dot(normal) > 0 ? 1 : -1;
            for (const std::int32_t n : nodes_of_pieces({&piece, 1}, cut.mesh))
                EXPECT_GT(own * (cut.mesh.nodes[n] - plane.point).dot(normal), -0.3 * 0.29) << k;
        }
    }
}

/// Triangles that meet in edges and corners leave no hole between them: they cut as their plane.
TEST(TetCut, TrianglesCutAsTheirPlane) {
    const TetMesh box = test::block({6, 6, 6}, unit_sides);
    for (const Vector3& normal : {Vector3(1, 0, 0), Vector3(1, 1, 0), Vector3(1, 2, 3)}) {
        const Vector3 a = normal.unitOrthogonal(), b = normal.cross(a).normalized();
        for (const int n : {1, 4, 13}) {
            const CutTets cut = tets_cut_by(box, sheet({0.5, 0.5, 0.5}, a, b, n));
            check_tet_mesh(cut.mesh, "cut");
            EXPECT_EQ(mesh_pieces(cut.mesh).size(), 2U) << normal.transpose() << ", " << n;
        }
    }
}

/// What opens is as large as the surface: its border is met, whatever tets it ends in.
TEST(TetCut, ACutEndsWhereItsSurfaceEnds) {
    const auto area_of = [](const TetMesh& mesh) {
        double area = 0;
        for (const auto& [a, b, c] : boundary_triangles(mesh.tets))
            area += (mesh.nodes[b] - mesh.nodes[a]).cross(mesh.nodes[c] - mesh.nodes[a]).norm() / 2;
        return area;
    };
    const TetMesh box = test::block({8, 8, 8}, unit_sides);
    const auto opened = [&](const CutSurface& surface) {
        const CutTets cut = tets_cut_by(box, surface);
        check_tet_mesh(cut.mesh, "cut");
        EXPECT_GT(least_angle_deg(cut.mesh), 5);
        return (area_of(cut.mesh) - 6) / 2;
    };
    const double disc = std::numbers::pi * 0.3 * 0.3;
    EXPECT_NEAR(opened(PlanePatch{{0.5, 0.5, 0.48}, {0, 0.1, 1}, 0.3}), disc, 0.07 * disc);
    for (const double width : {0.5, 0.57, 0.63, 0.69}) {
        const Vector3 a(width, 0, 0), b(0, 0, 2 * width), middle(0.51, 0.53, 0);
        EXPECT_NEAR(opened(PlanePatch{middle, {0, 1, 0}, {}, std::array{a, b}}), width * width,
                    0.09 * width * width);
        TriangleMesh two;
        for (const auto& [s, t] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}})
            two.nodes.push_back(middle + s * a + t * b);
        two.triangles = {{0, 1, 2}, {2, 3, 0}};
        EXPECT_NEAR(opened(two), width * width, 0.09 * width * width);
    }
}

/// A triangle that is no more than a point or an edge does not end a surface.
TEST(TetCut, FlatTrianglesHaveNoBorder) {
    TriangleMesh square;
    square.nodes = {{0, 0, 0.5}, {1, 0, 0.5}, {1, 1, 0.5}, {0, 1, 0.5}, {0.5, 0.5, 0.5}};
    square.triangles = {{0, 1, 2}, {2, 3, 0}, {4, 4, 4}, {0, 2, 2}};
    const TetMesh box = test::block({2, 2, 2}, unit_sides);
    const SegmentCrossings crossings(square, box.nodes, "square");
    const SurfaceBorder border = crossings.border();
    EXPECT_FALSE(nearest_on(border, {0.5, 0.5, 0.5}, 0.4));
    const auto nearest = nearest_on(border, {0.5, 0.1, 0.5}, 0.4);
    ASSERT_TRUE(nearest);
    EXPECT_LT((*nearest - Vector3(0.5, 0, 0.5)).norm(), 1e-8);
}

/// A disc inside opens, and the body still hangs together; one beside it changes nothing.
TEST(TetCut, ADiscEndsInside) {
    const TetMesh box = test::block({8, 8, 8}, unit_sides);
    const CutTets cut = tets_cut_by(box, PlanePatch{{0.5, 0.5, 0.48}, {0, 0.1, 1}, 0.3});
    check_tet_mesh(cut.mesh, "cut");
    EXPECT_GT(cut.counts.doubled, 5U);
    EXPECT_EQ(mesh_pieces(cut.mesh).size(), 1U);
    for (std::size_t n = cut.mesh.nodes.size() - cut.counts.doubled; n < cut.mesh.nodes.size(); ++n)
        EXPECT_LT((cut.mesh.nodes[n] - Vector3(0.5, 0.5, 0.48)).norm(), 0.3 + 0.2);
    const CutTets beside = tets_cut_by(box, PlanePatch{{2, 2, 2}, {0, 0, 1}, 0.3});
    EXPECT_EQ(beside.counts.parted, 0U);
    EXPECT_EQ(beside.mesh.tets, box.tets);
}

/// Sets go along: all of a face's triangles stay in its set, with the nodes of their own tets.
TEST(TetCut, RegionsAndSetsGoAlong) {
    TetMesh box = test::block({5, 5, 5}, unit_sides);
    box.node_sets["top"] =
        test::nodes_where(box, [](const Vector3& x) { return x.z() > 1 - 1e-9; });
    for (const Triangle& t : boundary_triangles(box.tets))
        if (std::ranges::all_of(t, [&](std::int32_t n) { return box.nodes[n].z() > 1 - 1e-9; }))
            box.triangle_sets["top"].push_back(t);
    for (const Tet& t : box.tets) box.regions.push_back(box.nodes[t[0]].x() < 0.39 ? 1 : 2);
    const CutTets cut = tets_cut_by(box, PlanePatch{{0.53, 0.5, 0.5}, {1, 0.3, 0.1}});
    EXPECT_EQ(cut.mesh.regions.size(), cut.mesh.tets.size());
    EXPECT_EQ(cut.mesh.node_sets.at("top"),
              test::nodes_where(cut.mesh, [](const Vector3& x) { return x.z() > 1 - 1e-9; }));
    double area = 0;
    std::vector<Triangle> boundary = boundary_triangles(cut.mesh.tets);
    for (const Triangle& t : cut.mesh.triangle_sets.at("top")) {
        const Vector3& x = cut.mesh.nodes[t[0]];
        area += (cut.mesh.nodes[t[1]] - x).cross(cut.mesh.nodes[t[2]] - x).norm() / 2;
        EXPECT_TRUE(std::ranges::any_of(
            boundary, [&](const Triangle& b) { return std::ranges::is_permutation(b, t); }));
    }
    EXPECT_NEAR(area, 1, 1e-9);
}

/// Levels of a cut body: no transfer has weight on the other side, and constants stay constants.
TEST(TetCut, TransfersStayOnTheirSide) {
    std::vector<TetMesh> levels{test::block({9, 9, 9}, unit_sides),
                                test::block({4, 4, 4}, unit_sides)};
    cut_levels(levels, PlanePatch{{0.46, 0.5, 0.5}, {1, 0.3, 0.2}}, "cut");
    const MeshHierarchy hierarchy = with_cut_transfers(std::move(levels), "cut");
    const auto side_of = [](const TetMesh& mesh) {
        std::vector<int> sides(mesh.nodes.size(), 0);
        const auto pieces = mesh_pieces(mesh);
        EXPECT_EQ(pieces.size(), 2U);
        for (const MeshPiece& piece : pieces)
            for (const std::int32_t n : nodes_of_pieces({&piece, 1}, mesh))
                sides[n] = piece.centroid.x() > 0.5 ? 1 : -1;
        return sides;
    };
    const auto fine = side_of(hierarchy.levels[0]), coarse = side_of(hierarchy.levels[1]);
    const BarycentricMap& map = hierarchy.transfers[0];
    std::size_t wrong = 0;
    for (std::size_t n = 0; n < map.size(); ++n) {
        double sum = 0;
        for (const double w : map.weights[n]) sum += w;
        EXPECT_NEAR(sum, 1, 1e-12);
        wrong += coarse[map.nodes[n][0]] != fine[n];
    }
    EXPECT_EQ(wrong, 0U);
}

TEST(TetCut, CoarsePiecesGoWithTheFineOnesLeftOut) {
    std::vector<TetMesh> levels{test::block({8, 4, 4}, unit_sides),
                                test::block({4, 2, 2}, unit_sides)};
    cut_levels(levels, PlanePatch{{0.4, 0.5, 0.5}, {1, 0, 0}}, "cut");
    std::vector<std::uint8_t> left_out(levels.front().tets.size(), 0);
    const auto pieces = mesh_pieces(levels.front());
    for (const std::int32_t e : pieces.back().cells) left_out[e] = 1;
    levels = without_tets(std::move(levels), left_out);
    for (const TetMesh& level : levels) {
        check_tet_mesh(level, "level");
        EXPECT_EQ(mesh_pieces(level).size(), 1U);
        EXPECT_NEAR(volume(level), 0.6, 0.05);
    }
}

TEST(TetCut, ACoarseLevelThatIsTooFineForWhatIsLeftIsLeftOut) {
    const std::vector<TetMesh> levels{test::block({8, 4, 4}, unit_sides),
                                      test::block({4, 2, 2}, unit_sides),
                                      test::block({1, 1, 1}, unit_sides)};
    std::vector<std::uint8_t> left_out(levels.front().tets.size(), 1);
    std::fill_n(left_out.begin(), 20, 0);
    const auto kept = without_tets(levels, left_out);
    ASSERT_EQ(kept.size(), 2U);
    EXPECT_EQ(kept[0].tets.size(), 20U);
    EXPECT_EQ(kept[1].tets.size(), levels[2].tets.size());
}

TEST(SegmentCrossings, RefusesWhatIsFarOrNotFinite) {
    const TetMesh box = test::block({1, 1, 1}, unit_sides);
    for (const double far : {1e3, std::nan("")}) {
        TriangleMesh surface = sheet({0.5, 0.5, 0.5}, Vector3::UnitX(), Vector3::UnitY(), 1);
        surface.nodes.front().z() = far;
        EXPECT_THROW(SegmentCrossings(surface, box.nodes, "cuts[0]"), Error);
    }
}

}  // namespace
}  // namespace livetet
