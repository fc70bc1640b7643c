// Points against a surface that moves: distances, robust weights, gradient.

#include "solvers/inverse/surface_misfit.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.hpp"
#include "mesh/shapes.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {
namespace {

/// A unit block's surface, and points outside of its faces, edges and corners.
class SurfaceMisfitTest : public testing::Test {
  protected:
    static std::vector<Vector3> around() {
        std::vector<Vector3> points;
        for (const double x : {-0.02, 0.31, 0.77, 1.03})
            for (const double y : {-0.04, 0.23, 1.01})
                for (const double z : {-0.03, 1.02}) points.emplace_back(x, y, z);
        return points;
    }
    const TetMesh mesh = shapes::box(Vector3(1, 1, 1), {3, 3, 3});
    const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
};

TEST_F(SurfaceMisfitTest, DistancesAreThoseFromTheBlock) {
    const SurfaceMatches matches = SurfaceMisfit(surface, around()).match(mesh.nodes, 0.05);
    std::size_t i = 0;
    for (const Vector3& c : around()) {
        const Vector3 inside = c.cwiseMax(0).cwiseMin(1);
        EXPECT_NEAR(std::abs(matches.points[i++].distance), (c - inside).norm(), 1e-12);
    }
}

TEST_F(SurfaceMisfitTest, GradientIsTheDerivativeOfTheValue) {
    const SurfaceMisfit misfit(surface, around());
    const double h = 1e-6;
    const std::vector<Vector3> gradient =
        misfit_gradient(misfit.match(mesh.nodes, 0.02), mesh.nodes.size());
    double size = 0;
    for (const Vector3& g : gradient) size = std::max(size, g.norm());
    EXPECT_GT(size, 1);
    for (const std::int32_t n : nodes_of(surface))
        for (int axis = 0; axis < 3; ++axis) {
            std::vector<Vector3> x = mesh.nodes;
            x[n][axis] += h;
            const double above = misfit.match(x, 0.02).value;
            x[n][axis] -= 2 * h;
            const double below = misfit.match(x, 0.02).value;
            EXPECT_NEAR(gradient[n][axis], (above - below) / (2 * h), 1e-4 * size) << n;
        }
}

TEST_F(SurfaceMisfitTest, AnOutlierAddsABoundedValueAndDoesNotPull) {
    std::vector<Vector3> points = around();
    const double before = SurfaceMisfit(surface, points).match(mesh.nodes, 0.01).value;
    points.emplace_back(0.5, 0.5, 3);
    const SurfaceMatches with = SurfaceMisfit(surface, points).match(mesh.nodes, 0.01);
    EXPECT_LT(with.value - before, 4.5);
    EXPECT_LT(with.points.back().confidence, 1e-6);
    EXPECT_DOUBLE_EQ(with.points.back().distance, 2);
}

TEST_F(SurfaceMisfitTest, ScaleFollowsTheMedianDownToTheSmallest) {
    std::vector<Vector3> points(11, Vector3(0.4, 0.5, 1.1));
    points.emplace_back(0.5, 0.5, 9);
    const SurfaceMisfit misfit(surface, points);
    EXPECT_NEAR(misfit.match_from_afar(mesh.nodes, 0.001).scale, 0.15, 1e-12);
    EXPECT_EQ(misfit.match_from_afar(mesh.nodes, 0.5).scale, 0.5);
}

TEST_F(SurfaceMisfitTest, MatchedNodesAreThoseOfTheFaceThatWasSeen) {
    const std::vector<Vector3> points(10, Vector3(0.1, 0.05, 1.01));
    const auto nodes = matched_nodes(SurfaceMisfit(surface, points).match(mesh.nodes, 1));
    ASSERT_EQ(nodes.size(), 3U);
    for (const std::int32_t n : nodes) EXPECT_EQ(mesh.nodes[n].z(), 1);
}

TEST_F(SurfaceMisfitTest, RefusesTooFewPointsAndThoseThatAreNotFinite) {
    std::vector<Vector3> points = around();
    EXPECT_THROW(SurfaceMisfit({}, points), Error);
    EXPECT_THROW(SurfaceMisfit(surface, std::span(points).first(9)), Error);
    points[3].y() = std::nan("");
    EXPECT_THROW(SurfaceMisfit(surface, points), Error);
}

}  // namespace
}  // namespace livetet
