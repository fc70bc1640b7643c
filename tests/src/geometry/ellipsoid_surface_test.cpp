#include "geometry/ellipsoid_surface.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <map>
#include <numbers>

#include "support/points.hpp"

namespace livetet {
namespace {

using test::Random;

/// By the divergence theorem: positive if the triangles face outwards.
double volume_of(const TriangleMesh& surface) {
    double sum = 0;
    for (const auto& [a, b, c] : surface.triangles)
        sum += surface.nodes[a].dot(surface.nodes[b].cross(surface.nodes[c])) / 6;
    return sum;
}

ErrorEllipsoid turned_ellipsoid(Random& random) {
    return {{0.009, 0.004, 0.002}, random.rotation()};
}

TEST(EllipsoidSurface, IsClosed) {
    const TriangleMesh& sphere = unit_sphere_surface();
    EXPECT_EQ(sphere.nodes.size(), 162U);
    EXPECT_EQ(sphere.triangles.size(), 320U);
    std::map<std::pair<std::int32_t, std::int32_t>, int> edges;
    for (const Triangle& t : sphere.triangles)
        for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    for (const auto& [edge, count] : edges) {
        EXPECT_EQ(count, 1) << edge.first << " " << edge.second;
        EXPECT_EQ(edges.count({edge.second, edge.first}), 1U) << edge.first << " " << edge.second;
    }
    EXPECT_EQ(edges.size(), 960U);
}

TEST(EllipsoidSurface, FacesOutwards) {
    Random random(5);
    const Vector3 centre(0.1, -0.2, 0.3);
    const TriangleMesh surface = ellipsoid_surface(centre, turned_ellipsoid(random));
    for (const auto& [a, b, c] : surface.triangles) {
        const Vector3 &p = surface.nodes[a], &q = surface.nodes[b], &r = surface.nodes[c];
        EXPECT_GT((q - p).cross(r - p).dot((p + q + r) / 3 - centre), 0);
    }
}

TEST(EllipsoidSurface, HasTheVolumeOfTheEllipsoid) {
    Random random(6);
    const ErrorEllipsoid ellipsoid = turned_ellipsoid(random);
    const double expected = 4.0 / 3 * std::numbers::pi * ellipsoid.semi_axes.prod();
    const double found = volume_of(ellipsoid_surface({0.1, -0.2, 0.3}, ellipsoid));
    EXPECT_NEAR(found / expected, 0.966, 0.001);
}

TEST(EllipsoidSurface, NodesHaveTheStatedMahalanobisDistance) {
    Random random(7);
    const Vector3 s(0.003, 0.002, 0.001), centre(0.1, -0.2, 0.3);
    const Eigen::Matrix3d axes = random.rotation();
    const Eigen::Matrix3d covariance = axes * s.cwiseAbs2().asDiagonal() * axes.transpose();
    for (const Vector3& x : ellipsoid_surface(centre, error_ellipsoid(covariance)).nodes)
        EXPECT_NEAR((x - centre).dot(covariance.inverse() * (x - centre)), 7.8147, 1e-3);
}

TEST(EllipsoidSurface, WithoutASpreadIsAPoint) {
    for (const Vector3& x :
         ellipsoid_surface({1, 2, 3}, error_ellipsoid(Eigen::Matrix3d::Zero())).nodes)
        EXPECT_EQ(x, Vector3(1, 2, 3));
}

}  // namespace
}  // namespace livetet
