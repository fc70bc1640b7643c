#include "geometry/nearest_triangle.hpp"

#include <gtest/gtest.h>

#include <random>

#include "mesh/shapes.hpp"

namespace livetet {
namespace {

Vector3 at(const std::array<double, 3>& w, const Vector3& a, const Vector3& b, const Vector3& c) {
    return w[0] * a + w[1] * b + w[2] * c;
}

TEST(NearestTriangle, is_never_beaten_by_a_sampled_point_of_the_triangle) {
    const Vector3 a(0, 0, 0), b(1, 0.1, 0), c(0.3, 0.8, 0.2);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> unit(-2, 3);
    for (int trial = 0; trial < 300; ++trial) {
        const Vector3 x(unit(random), unit(random), unit(random));
        const double found = (at(nearest_weights(x, a, b, c), a, b, c) - x).norm();
        double sampled = 1e9;
        for (int i = 0; i <= 60; ++i)
            for (int j = 0; i + j <= 60; ++j)
                sampled = std::min(
                    sampled, (at({(60 - i - j) / 60.0, i / 60.0, j / 60.0}, a, b, c) - x).norm());
        EXPECT_LE(found, sampled + 1e-12);
        EXPECT_GE(found, sampled - 0.02);
    }
}

TEST(NearestTriangle, stays_finite_on_triangles_without_area) {
    const Vector3 a(0, 0, 0), b(1, 0, 0), x(0.4, 1, 0);
    for (const Vector3& c : {Vector3(2, 0, 0), Vector3(0.5, 0, 0), a, b}) {
        const auto w = nearest_weights(x, a, b, c);
        EXPECT_NEAR(w[0] + w[1] + w[2], 1, 1e-14);
        EXPECT_NEAR((at(w, a, b, c) - x).norm(), 1, 1e-12);
    }
    const auto w = nearest_weights(x, a, a, a);
    EXPECT_EQ(at(w, a, a, a), a);
}

TEST(NearestTriangle, agrees_with_a_search_over_all_triangles) {
    const TriangleMesh sphere = shapes::sphere(0.05, 3);
    const NearestTriangle nearest(sphere.nodes, sphere.triangles);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-0.1, 0.1);
    for (int trial = 0; trial < 100; ++trial) {
        const Vector3 x(unit(random), unit(random), unit(random));
        double best = 1e9;
        for (const auto& [i, j, k] : sphere.triangles) {
            const Vector3 &a = sphere.nodes[i], &b = sphere.nodes[j], &c = sphere.nodes[k];
            best = std::min(best, (at(nearest_weights(x, a, b, c), a, b, c) - x).norm());
        }
        const auto hit = nearest.find(x);
        EXPECT_NEAR(hit.distance, best, 1e-15);
        const auto& [i, j, k] = sphere.triangles[hit.triangle];
        EXPECT_NEAR((at(hit.weights, sphere.nodes[i], sphere.nodes[j], sphere.nodes[k]) - x).norm(),
                    best, 1e-15);
    }
}

}  // namespace
}  // namespace livetet
