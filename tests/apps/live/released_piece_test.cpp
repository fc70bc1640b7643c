#include "apps/live/released_piece.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <limits>

#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A block of 20 x 10 x 10 mm, all of one piece.
struct FreeBlock {
    TetMesh mesh = test::block({4, 2, 2}, {0.02, 0.01, 0.01});
    MeshPiece piece = mesh_pieces(mesh).front();

    /// Moved rigidly and stretched along x by a share.
    std::vector<Vector3> moved(const Vector3& by, double stretch) const {
        const Eigen::AngleAxisd turn(0.3, Vector3(1, 2, 0).normalized());
        std::vector<Vector3> u;
        for (const Vector3& x : mesh.nodes) {
            const Vector3 from_centre = x - piece.centroid;
            const Vector3 to = turn * (from_centre + stretch * from_centre.x() * Vector3::UnitX());
            u.push_back(piece.centroid + to + by - x);
        }
        return u;
    }
};

TEST(ReleasedPiece, TakesItsShapeAtRestWhereItIs) {
    const FreeBlock block;
    const Vector3 by(0.003, -0.002, 0.02);
    std::vector<Vector3> u = block.moved(by, 0.4);
    ASSERT_TRUE(release_piece(block.piece, block.mesh, u));
    const std::vector<Vector3> rigid = block.moved(by, 0);
    for (std::size_t n = 0; n < u.size(); ++n) EXPECT_LT((u[n] - rigid[n]).norm(), 1e-12) << n;
}

TEST(ReleasedPiece, GoesBackFromFartherThanTheBodyIsLarge) {
    const FreeBlock block;
    std::vector<Vector3> far = block.moved({0, 0, -0.026}, 0.4), lost = far;
    lost[3].x() = std::numeric_limits<double>::quiet_NaN();
    std::vector<Vector3> a_line = block.moved({0, 0, 0}, 1000), a_point;
    for (const Vector3& x : block.mesh.nodes) a_point.push_back(block.piece.centroid - x);
    for (std::vector<Vector3>* u : {&far, &lost, &a_line, &a_point}) {
        EXPECT_FALSE(release_piece(block.piece, block.mesh, *u));
        for (const Vector3& x : *u) EXPECT_EQ(x, Vector3(0, 0, 0));
    }
}

TEST(ReleasedPiece, OthersStayWhereTheyAre) {
    FreeBlock block;
    const TetMesh other = test::block({2, 2, 2}, {0.01, 0.01, 0.01});
    const auto first = static_cast<std::int32_t>(block.mesh.nodes.size());
    for (const Vector3& x : other.nodes) block.mesh.nodes.push_back(x + Vector3(0.05, 0, 0));
    for (Tet t : other.tets) {
        for (std::int32_t& n : t) n += first;
        block.mesh.tets.push_back(t);
    }
    std::vector<Vector3> u(block.mesh.nodes.size(), Vector3(0.001, 0, 0));
    u.back() = Vector3(0, 0, 0.002);
    u.front() = Vector3(0, 0.001, 0);
    const std::vector<Vector3> before = u;
    ASSERT_TRUE(release_piece(mesh_pieces(block.mesh).front(), block.mesh, u));
    EXPECT_NE(u.front(), before.front());
    for (std::size_t n = static_cast<std::size_t>(first); n < u.size(); ++n)
        EXPECT_EQ(u[n], before[n]) << n;
}

}  // namespace
}  // namespace livetet
