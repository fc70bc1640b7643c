#include "mesh/geodesic.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mesh/shapes.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {
namespace {

/// Neither less than the distance nor more than 2 % above it, for nodes farther than `from`.
void expect_distances(const std::map<std::int32_t, double>& found, double from,
                      const std::function<double(std::int32_t)>& exact, double below = 0) {
    for (const auto& [node, distance] : found) {
        if (exact(node) < from) continue;
        EXPECT_GE(distance, (1 - below) * exact(node) - 1e-12);
        EXPECT_LE(distance, 1.02 * exact(node)) << node;
    }
}

/// Along edges the distance across the squares' other diagonal is 41 % too long.
TEST(Geodesic, is_the_straight_line_on_a_plane_whatever_its_triangles) {
    const TetMesh mesh = shapes::box({0.1, 0.1, 0.01}, {10, 10, 1});
    for (const bool shaken : {false, true}) {
        std::vector<Vector3> nodes = mesh.nodes;
        std::mt19937 random(1);
        std::uniform_real_distribution<double> push(-0.003, 0.003);
        if (shaken)
            for (Vector3& x : nodes) x.head<2>() += Eigen::Vector2d(push(random), push(random));
        const std::int32_t centre = 11 * 11 + 5 * 11 + 5;
        const auto found =
            distances_on_surface(nodes, boundary_triangles(mesh.tets), centre, 0.045);
        std::size_t within = 0;
        for (const Vector3& x : nodes)
            within += x.z() > 0.005 && (x - nodes[centre]).norm() <= 0.045 / 1.02;
        EXPECT_GE(found.size(), within) << "none within the radius is missed";
        expect_distances(found, 0,
                         [&](std::int32_t n) { return (nodes[n] - nodes[centre]).norm(); });
    }
}

TEST(Geodesic, is_the_arc_on_a_sphere) {
    const TriangleMesh sphere = shapes::sphere(0.05, 3);
    const auto found = distances_on_surface(sphere.nodes, sphere.triangles, 0, 0.09);
    EXPECT_GT(found.size(), sphere.nodes.size() / 2);
    const auto arc = [&](std::int32_t n) {
        return 0.05 * std::acos(std::clamp(sphere.nodes[0].dot(sphere.nodes[n]) / 0.0025, -1., 1.));
    };
    expect_distances(found, 0, arc, 0.01);  // chords are shorter than arcs
}

}  // namespace
}  // namespace livetet
