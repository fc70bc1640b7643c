// Nodes that move onto a cut: along the boundary, and no farther than angles allow.

#include "mesh/movable_nodes.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "mesh/least_dihedral.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

const Vector3 movable_size(4, 4, 4);

class MovableNodesTest : public testing::Test {
  protected:
    std::int32_t node_at(const Vector3& place) const {
        const auto found =
            test::nodes_where(mesh, [&](const Vector3& x) { return (x - place).norm() < 1e-9; });
        EXPECT_EQ(found.size(), 1U) << place.transpose();
        return found.at(0);
    }
    double least_angle() const {
        double least = std::numbers::pi;
        for (const Tet& t : mesh.tets) least = std::min(least, least_dihedral(mesh.nodes, t));
        return least;
    }

    TetMesh mesh = test::block({4, 4, 4}, movable_size);  // cells of unit length
    MovableNodes nodes{mesh};
};

TEST_F(MovableNodesTest, KnowTheirTetsAndBoundary) {
    for (std::int32_t n = 0; n < std::ssize(mesh.nodes); ++n) {
        for (const std::int32_t e : nodes.tets_at(n))
            EXPECT_TRUE(std::ranges::find(mesh.tets[e], n) != mesh.tets[e].end());
        for (const std::int32_t i : nodes.boundary_at(n))
            EXPECT_TRUE(std::ranges::find(nodes.triangle(i), n) != nodes.triangle(i).end());
    }
    EXPECT_TRUE(nodes.boundary_at(node_at({2, 2, 2})).empty());
    EXPECT_FALSE(nodes.boundary_at(node_at({2, 2, 0})).empty());
}

TEST_F(MovableNodesTest, InsideGoStraightToAPlane) {
    const Vector3 normal = Vector3(1, 2, -2) / 3, point(2.1, 2, 2);
    const Vector3 way = nodes.way_to_plane(node_at({2, 2, 2}), point, normal);
    EXPECT_LT((way - 0.1 / 3 * normal).norm(), 1e-15);
}

/// On a face in the face, on an edge along it, at a corner not at all.
TEST_F(MovableNodesTest, OfTheBoundaryStayInIt) {
    const Vector3 normal = Vector3(1, 1, 1).normalized();
    const Vector3 face(2, 2, 0), edge(2, 0, 0), corner(0, 0, 0), off(0.2, 0, 0);
    const Vector3 in_face = nodes.way_to_plane(node_at(face), face + off, normal);
    EXPECT_LT((in_face - Vector3(0.1, 0.1, 0)).norm(), 1e-12);
    const Vector3 on_edge = nodes.way_to_plane(node_at(edge), edge + off, normal);
    EXPECT_LT((on_edge - off).norm(), 1e-12);
    EXPECT_EQ(nodes.way_to_plane(node_at(corner), corner + off, normal), Vector3::Zero());
    // A plane along the face is reached nowhere in it.
    EXPECT_EQ(nodes.way_to_plane(node_at(face), {0, 0, 0.1}, Vector3::UnitZ()), Vector3::Zero());
    EXPECT_TRUE(nodes.keeps_boundary(node_at(face), {0.3, -0.2, 0.01}));
    EXPECT_FALSE(nodes.keeps_boundary(node_at(face), {0.3, -0.2, 0.1}));
}

TEST_F(MovableNodesTest, MoveAsFarAsAnglesAllow) {
    const std::int32_t n = node_at({2, 2, 2});
    const Vector3 little(0.05, 0, 0.02);
    EXPECT_EQ(nodes.move(n, little), little);
    EXPECT_LT((mesh.nodes[n] - Vector3(2.05, 2, 2.02)).norm(), 1e-15);
    const Vector3 across(3, 0, 0);  // through its neighbours, in each part
    EXPECT_EQ(nodes.move(n, across), Vector3::Zero());
    EXPECT_LT((mesh.nodes[n] - Vector3(2.05, 2, 2.02)).norm(), 1e-15);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-0.8, 0.8);
    int moved = 0, in_part = 0;
    for (int k = 0; k < 400; ++k) {
        const auto any = static_cast<std::int32_t>(random() % mesh.nodes.size());
        const Vector3 way(uniform(random), uniform(random), uniform(random));
        if (!nodes.boundary_at(any).empty()) continue;
        const Vector3 went = nodes.move(any, way);
        moved += went.norm() > 0;
        in_part += went.norm() > 0 && went.norm() < 0.9 * way.norm();
        ASSERT_GT(least_angle(), 14.99 * std::numbers::pi / 180) << k;
    }
    EXPECT_GT(moved, 20);
    EXPECT_GT(in_part, 5);
}

}  // namespace
}  // namespace livetet
