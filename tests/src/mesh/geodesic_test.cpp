#include "mesh/geodesic.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
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

SurfacePoint at_node(std::span<const Vector3> nodes, std::span<const Triangle> triangles,
                     std::int32_t node) {
    const auto at = std::ranges::find_if(
        triangles, [&](const Triangle& t) { return std::ranges::count(t, node) > 0; });
    return {static_cast<std::size_t>(at - triangles.begin()), nodes[node]};
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
        const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
        const auto found =
            distances_on_surface(nodes, surface, at_node(nodes, surface, centre), 0.045);
        std::size_t within = 0;
        for (const Vector3& x : nodes)
            within += x.z() > 0.005 && (x - nodes[centre]).norm() <= 0.045 / 1.02;
        EXPECT_GE(found.size(), within) << "none within the radius is missed";
        expect_distances(found, 0,
                         [&](std::int32_t n) { return (nodes[n] - nodes[centre]).norm(); });
    }
}

/// The error falls with the triangles: to a thousandth of the distance on a plane of shaken ones
/// (shortest paths through six points an edge leave up to a hundredth, on any mesh), and on a
/// sphere by more than half where their edges are halved.
TEST(Geodesic, converges_with_the_mesh) {
    const TetMesh mesh = shapes::box({0.1, 0.1, 0.01}, {20, 20, 1});
    std::vector<Vector3> nodes = mesh.nodes;
    std::mt19937 random(2);
    std::uniform_real_distribution<double> push(-0.001, 0.001);
    for (Vector3& x : nodes) x.head<2>() += Eigen::Vector2d(push(random), push(random));
    const std::int32_t centre = 21 * 21 + 10 * 21 + 10;
    const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
    double worst = 0;
    for (const auto& [n, distance] :
         distances_on_surface(nodes, surface, at_node(nodes, surface, centre), 0.03))
        if (n != centre) {
            const double exact = (nodes[n] - nodes[centre]).norm();
            EXPECT_GE(distance, exact - 1e-12);
            worst = std::max(worst, distance / exact - 1);
        }
    EXPECT_LT(worst, 1e-3);

    std::array<double, 2> mean{};
    for (const int splits : {3, 4}) {
        const TriangleMesh sphere = shapes::sphere(0.05, splits);
        const auto found = distances_on_surface(sphere.nodes, sphere.triangles,
                                                at_node(sphere.nodes, sphere.triangles, 0), 0.06);
        for (const auto& [n, distance] : found) {
            const double cosine = sphere.nodes[0].dot(sphere.nodes[n]) / 0.0025;
            const double arc = 0.05 * std::acos(std::clamp(cosine, -1., 1.));
            if (n != 0) mean[splits - 3] += std::abs(distance / arc - 1) / found.size();
        }
    }
    EXPECT_LT(mean[1], 0.5 * mean[0]) << mean[0];
}

TEST(Geodesic, begins_anywhere_in_a_triangle) {
    const TetMesh mesh = shapes::box({0.1, 0.1, 0.01}, {10, 10, 1});
    const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
    const auto upper = std::ranges::find_if(surface, [&](const Triangle& t) {
        return std::ranges::all_of(t, [&](std::int32_t n) {
            const Vector3& x = mesh.nodes[n];
            return x.z() > 0.005 && (x.head<2>().array() - 0.05).abs().maxCoeff() < 0.02;
        });
    });
    ASSERT_NE(upper, surface.end());
    const Vector3 from = 0.5 * mesh.nodes[(*upper)[0]] + 0.3 * mesh.nodes[(*upper)[1]] +
                         0.2 * mesh.nodes[(*upper)[2]];
    const auto found = distances_on_surface(
        mesh.nodes, surface, {static_cast<std::size_t>(upper - surface.begin()), from}, 0.03);
    EXPECT_GT(found.size(), 20u);
    expect_distances(found, 0, [&](std::int32_t n) { return (mesh.nodes[n] - from).norm(); });
}

TEST(Geodesic, is_the_arc_on_a_sphere) {
    const TriangleMesh sphere = shapes::sphere(0.05, 3);
    const auto found = distances_on_surface(sphere.nodes, sphere.triangles,
                                            at_node(sphere.nodes, sphere.triangles, 0), 0.09);
    EXPECT_GT(found.size(), sphere.nodes.size() / 2);
    const auto arc = [&](std::int32_t n) {
        return 0.05 * std::acos(std::clamp(sphere.nodes[0].dot(sphere.nodes[n]) / 0.0025, -1., 1.));
    };
    expect_distances(found, 0, arc, 0.01);  // chords are shorter than arcs
}

}  // namespace
}  // namespace livetet
