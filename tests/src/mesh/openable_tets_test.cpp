// Meshes of tets that open along surfaces, part by part.

#include "mesh/openable_tets.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <numbers>
#include <random>

#include "base/error.hpp"
#include "mesh/least_dihedral.hpp"
#include "mesh/mesh_pieces.hpp"
#include "mesh/quadratic.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A box of 60 mm in tets with edges of 10 mm, and a coarser level.
std::vector<TetMesh> box_levels() {
    return {test::block({6, 6, 6}, Vector3::Constant(0.06)),
            test::block({3, 3, 3}, Vector3::Constant(0.06))};
}
const Vector3 box_middle(0.0293, 0.0312, 0.0304);

/// The part of a plane's square, 200 mm wide, from `begin` to `end` of its width, as a blade sweeps
/// it in 50 steps.
TriangleMesh swept(const Vector3& normal, int begin, int end) {
    const Vector3 a = normal.unitOrthogonal(), b = normal.cross(a).normalized();
    const auto place = [&](int step, double side) -> Vector3 {
        return box_middle + 0.004 * (step - 25) * a + 0.1 * side * b;
    };
    TriangleMesh surface;
    for (int k = begin; k < end; ++k) {
        const auto first = static_cast<std::int32_t>(surface.nodes.size());
        for (const Vector3& x : {place(k, -1), place(k, 1), place(k + 1, -1), place(k + 1, 1)})
            surface.nodes.push_back(x);
        surface.triangles.push_back({first, first + 1, first + 3});
        surface.triangles.push_back({first, first + 3, first + 2});
    }
    return surface;
}

double smallest_angle_deg(const TetMesh& mesh) {
    double least = std::numbers::pi;
    for (const Tet& t : mesh.tets) least = std::min(least, least_dihedral(mesh.nodes, t));
    return least * 180 / std::numbers::pi;
}

/// Whatever the plane's direction, all levels open in two pieces, each on its side, without flat
/// tets; and linear fields are carried over as they are, as nodes moved.
TEST(OpenableTets, PlanesPartAllLevelsInTwo) {
    std::mt19937 random(1);
    std::normal_distribution<double> any;
    Eigen::Matrix3d slope;
    slope << 0.1, 0.2, -0.1, 0.3, -0.2, 0.1, 0.05, 0.1, 0.2;
    double off_plane = 0, as_loaded = 0;
    for (int k = 0; k < 30; ++k) {
        const Vector3 normal = Vector3(any(random), any(random), any(random)).normalized();
        const std::vector<TetMesh> levels = box_levels();
        OpenableTets tets(levels, "box");
        for (int step = 0; step < 50; ++step) tets.cut(swept(normal, step, step + 1));
        const OpenedLevels opened = tets.open(levels);
        for (const TetMesh& level : opened.levels) {
            check_tet_mesh(level, "opened");
            EXPECT_GT(smallest_angle_deg(level), 14) << k;
            EXPECT_NEAR(volume(level), volume(levels[0]), 1e-3 * volume(levels[0])) << k;
            EXPECT_EQ(mesh_pieces(level).size(), 2U) << k;
        }
        const TetMesh& finest = opened.levels.front();
        std::vector<Vector3> u;
        for (const Vector3& x : levels.front().nodes) u.push_back(slope * x);
        carry_values(u, opened.nodes);
        ASSERT_EQ(u.size(), finest.nodes.size());
        for (std::size_t n = 0; n < u.size(); ++n)
            EXPECT_LT((u[n] - slope * finest.nodes[n]).norm(), 1e-12);
        for (const std::int32_t n : opened.nodes.originals) {
            off_plane += std::abs((finest.nodes[n] - box_middle).dot(normal));
            as_loaded += std::abs((levels.front().nodes[n] - box_middle).dot(normal));
        }
    }
    EXPECT_LT(off_plane, 0.55 * as_loaded) << "nodes move onto the plane";
}

/// A plane that comes in parts, opened in between, parts what it parts at once: the same cells, but
/// for nodes that moved before.
TEST(OpenableTets, CutsInPartsAddUp) {
    const Vector3 normal = Vector3(1, 0.3, -0.2).normalized();
    const std::vector<TetMesh> levels = box_levels();
    OpenableTets at_once(levels, "box"), in_parts(levels, "box");
    at_once.cut(swept(normal, 0, 50));
    const TetMesh whole = at_once.open(levels).levels.front();
    std::vector<TetMesh> now = levels;
    std::size_t copies = 0;
    for (int begin = 0; begin < 50; begin += 10) {
        for (int step = begin; step < begin + 10; ++step)
            in_parts.cut(swept(normal, step, step + 1));
        OpenedLevels opened = in_parts.open(now);
        in_parts.keep();
        copies += opened.nodes.originals.size();
        for (const MovedNode& m : opened.nodes.moved)
            EXPECT_LT(static_cast<std::size_t>(m.node), levels.front().nodes.size())
                << "a node moves once";
        now = std::move(opened.levels);
        check_tet_mesh(now.front(), "opened");
        EXPECT_GT(smallest_angle_deg(now.front()), 14);
    }
    EXPECT_EQ(copies, whole.nodes.size() - levels.front().nodes.size());
    const auto pieces = mesh_pieces(now.front()), expected = mesh_pieces(whole);
    ASSERT_EQ(pieces.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(pieces[i].cells, expected[i].cells);
    EXPECT_EQ(in_parts.parted(), [&] {
        at_once.keep();
        return at_once.parted();
    }());
    EXPECT_EQ(in_parts.cut(swept(normal, 20, 30)), 0U) << "a blade that goes back cuts nothing";
}

TEST(OpenableTets, WhatIsUndoneIsNotCut) {
    const std::vector<TetMesh> levels = box_levels();
    OpenableTets tets(levels, "box");
    EXPECT_GT(tets.cut(swept(Vector3::UnitX(), 0, 50)), 0U);
    EXPECT_FALSE(tets.open(levels).nodes.originals.empty());
    tets.undo();
    const OpenedLevels whole = tets.open(levels);
    EXPECT_TRUE(whole.nodes.originals.empty() && whole.nodes.moved.empty());
    EXPECT_EQ(whole.levels.front().tets, levels.front().tets);
    TriangleMesh broken = swept(Vector3::UnitX(), 0, 50);
    broken.nodes[1].x() = std::nan("");
    EXPECT_THROW(tets.cut(broken), Error);
}

/// In a body that is bent, and parted with its parts pulled away from each other, points lie at
/// rest where they were; one in the gap near the cut.
TEST(OpenableTets, PointsOfADeformedBodyAreFoundAtRest) {
    const std::vector<TetMesh> levels = box_levels();
    OpenableTets tets(levels, "box");
    tets.cut(swept(Vector3::UnitX(), 0, 50));
    const TetMesh mesh = tets.open(levels).levels.front();
    tets.keep();
    std::vector<Vector3> u(mesh.nodes.size());
    const auto pieces = mesh_pieces(mesh);
    ASSERT_EQ(pieces.size(), 2U);
    for (const MeshPiece& piece : pieces)
        for (const std::int32_t n : nodes_of_pieces({&piece, 1}, mesh)) {
            const Vector3& x = mesh.nodes[n];
            u[n] = {piece.centroid.x() < box_middle.x() ? -0.01 : 0.01, 0.1 * x.x(), -0.2 * x.y()};
        }
    const auto moved = [](const Vector3& x, double side) -> Vector3 {
        return x + Vector3(side, 0.1 * x.x(), -0.2 * x.y());
    };
    for (const Vector3& x : {Vector3(0.013, 0.021, 0.035), Vector3(0.002, 0.058, 0.011)})
        EXPECT_LT((tets.rest_place(moved(x, -0.01), mesh, u) - x).norm(), 1e-7);
    const Vector3 right(0.047, 0.033, 0.02), inside_gap(0.03, 0.03, 0.03);
    EXPECT_LT((tets.rest_place(moved(right, 0.01), mesh, u) - right).norm(), 1e-7);
    EXPECT_LT(std::abs(tets.rest_place(inside_gap, mesh, u).x() - box_middle.x()), 0.01);
    EXPECT_NEAR(tets.cell_edge(), 0.012, 0.002);
}

struct Link {
    std::int32_t lower, upper;
};

/// Six cells in a row.
TEST(LinkCuts, SmallPiecesHangTogetherWithALargerOneOrWithEachOther) {
    const std::vector<Link> links{{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}};
    LinkCuts cuts(links.size());
    cuts.cut = {0, 1, 0, 0, 1};  // 2 + 3 + 1 cells
    cuts.rejoin_small_pieces(links, 6, 3);
    EXPECT_EQ(cuts.cut, (std::vector<std::uint8_t>{0, 0, 0, 0, 0}));
    cuts.cut = {0, 0, 1, 0, 0};
    cuts.rejoin_small_pieces(links, 6, 3);
    cuts.keep();  // 3 + 3
    EXPECT_EQ(cuts.parted(), 1U);
    cuts.cut[0] = 1;  // what was cut off is cut again, into crumbs
    cuts.rejoin_small_pieces(links, 6, 3);
    EXPECT_EQ(cuts.cut, cuts.kept);
}

/// Tets that a file lists twice are no neighbours of each other.
TEST(TetLinks, TheSameTetTwiceIsNoLink) {
    const std::vector<Tet> tets{{0, 1, 2, 3}, {1, 2, 3, 4}, {1, 0, 3, 2}};
    for (const auto& [lower, upper] : links_of(tets)) {
        EXPECT_TRUE(lower == 1 || upper == 1) << lower << " " << upper;
    }
}

TEST(OpenableTets, HoldThePlacesInTheirTets) {
    const OpenableTets tets({test::block({3, 3, 3}, {0.03, 0.03, 0.03})}, "box");
    EXPECT_TRUE(tets.holds({0.011, 0.022, 0.029}));
    EXPECT_FALSE(tets.holds({0.011, 0.022, 0.031}));
    EXPECT_FALSE(tets.holds({-0.001, 0.022, 0.029}));
}

/// Places stay in their tets, also where nodes moved onto the cut: fields that are linear in the
/// opened mesh are found exactly, and so is the piece that a place is in.
TEST(OpenableTets, PlacesStayInTheirTets) {
    const std::vector<TetMesh> levels = box_levels();
    const TetMesh& before = levels.front();
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(0, 0.06);
    std::vector<Vector3> places;
    for (int k = 0; k < 500; ++k) places.emplace_back(place(random), place(random), place(random));
    std::vector<Vector3> points = places;  // every other one half a millimetre outside
    for (std::size_t i = 0; i < places.size(); i += 2) {
        places[i].z() = 0.06;
        points[i].z() = 0.0605;
    }
    const PointSampler sampler(before, points);
    OpenableTets tets(levels, "box");
    const Vector3 normal = Vector3(0.3, 0.8, 0.4).normalized();
    for (int step = 0; step < 50; ++step) tets.cut(swept(normal, step, step + 1));
    const OpenedLevels opened = tets.open(levels);
    const TetMesh& after = opened.levels.front();
    ASSERT_FALSE(opened.nodes.moved.empty());
    const PointSampler cut = sampler.after_cut(before, after);
    const MeshPiece piece = mesh_pieces(after).back();
    std::vector<Vector3> pieces(after.nodes.size(), Vector3::Zero());
    for (const std::int32_t n : nodes_of_pieces({&piece, 1}, after)) pieces[n] = Vector3::Ones();
    const double side = std::copysign(1.0, (piece.centroid - box_middle).dot(normal));
    for (std::size_t i = 0; i < places.size(); ++i) {
        EXPECT_LT((cut.sample(i, after.nodes) - places[i]).norm(), 1e-15);
        const double height = side * (places[i] - box_middle).dot(normal);
        if (std::abs(height) < 0.01) continue;
        EXPECT_NEAR(cut.sample(i, pieces).x(), height > 0, 1e-14) << places[i].transpose();
    }
}

}  // namespace
}  // namespace livetet
