#include "mesh/barycentric_map.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "base/error.hpp"
#include "mesh/shapes.hpp"

namespace livetet {
namespace {

const Vector3 box_size(0.15, 0.11, 0.08);

std::vector<Vector3> random_points(std::size_t count, const Vector3& low, const Vector3& high) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<Vector3> points(count);
    for (Vector3& x : points)
        x = low + (high - low).cwiseProduct(Vector3(unit(random), unit(random), unit(random)));
    return points;
}

void expect_convex_weights(const BarycentricMap& map, std::size_t i) {
    double sum = 0;
    for (const double w : map.weights[i]) {
        EXPECT_GE(w, 0) << "point " << i;
        EXPECT_LE(w, 1) << "point " << i;
        sum += w;
    }
    EXPECT_NEAR(sum, 1, 1e-14) << "point " << i;
    for (int a = 0; a < 4; ++a)
        for (int b = 0; b < a; ++b) EXPECT_NE(map.nodes[i][a], map.nodes[i][b]) << "point " << i;
}

TEST(BarycentricMap, reproduces_linear_fields_inside) {
    const TetMesh mesh = shapes::box(box_size, {9, 7, 5});
    const std::vector<Vector3> points = random_points(2000, Vector3::Zero(), box_size);
    Eigen::Matrix3d gradient;
    gradient << 1, -2, 0.5, 3, 0.25, -1, 0.1, 4, 2;
    const Vector3 constant(5, -6, 7);
    std::vector<Vector3> values;
    for (const Vector3& x : mesh.nodes) values.push_back(gradient * x + constant);
    const BarycentricMap map = map_into(mesh, points);
    ASSERT_EQ(map.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        expect_convex_weights(map, i);
        EXPECT_EQ(map.distance[i], 0);
        EXPECT_LT((interpolate(map, i, values) - (gradient * points[i] + constant)).norm(), 1e-12);
    }
}

TEST(BarycentricMap, holds_points_on_nodes_edges_and_faces) {
    const TetMesh mesh = shapes::box(box_size, {4, 3, 2});
    std::vector<Vector3> points = mesh.nodes;
    for (const Tet& t : mesh.tets)
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < a; ++b) {
                points.push_back(0.3 * mesh.nodes[t[a]] + 0.7 * mesh.nodes[t[b]]);
                for (int c = 0; c < b; ++c)
                    points.push_back((mesh.nodes[t[a]] + mesh.nodes[t[b]] + mesh.nodes[t[c]]) / 3);
            }
    const BarycentricMap map = map_into(mesh, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
        expect_convex_weights(map, i);
        EXPECT_LT(map.distance[i], 1e-12);
        EXPECT_LT((interpolate(map, i, mesh.nodes) - points[i]).norm(), 1e-9);
    }
}

TEST(BarycentricMap, takes_the_nearest_boundary_point_of_points_outside) {
    const TetMesh mesh = shapes::box(box_size, {5, 4, 3});
    std::vector<Vector3> points = random_points(3000, -box_size, 2 * box_size);
    points.push_back({-1e-9, 0.03, 0.03});          // almost on a face
    points.push_back({-0.001, -0.001, 0.03});       // beside an edge
    points.push_back(box_size + Vector3(1, 2, 3));  // beyond a corner, far away
    const BarycentricMap map = map_into(mesh, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
        expect_convex_weights(map, i);
        const Vector3 nearest = points[i].cwiseMax(Vector3::Zero()).cwiseMin(box_size);
        EXPECT_LT((interpolate(map, i, mesh.nodes) - nearest).norm(), 1e-9) << "point " << i;
        EXPECT_NEAR(map.distance[i], (points[i] - nearest).norm(), 1e-9) << "point " << i;
    }
}

TEST(BarycentricMap, extrapolates_linear_fields_a_little_way_out_and_no_weight_runs_away) {
    const TetMesh mesh = shapes::box(box_size, {5, 4, 3});
    Eigen::Matrix3d gradient;
    gradient << 1, -2, 0.5, 3, 0.25, -1, 0.1, 4, 2;
    std::vector<Vector3> values;
    for (const Vector3& x : mesh.nodes) values.push_back(gradient * x);
    const Vector3 cell = box_size.cwiseQuotient(Vector3(5, 4, 3));
    const std::vector<Vector3> near = random_points(2000, -0.2 * cell, box_size + 0.2 * cell);
    const BarycentricMap map = map_into(mesh, near, Outside::extrapolated);
    for (std::size_t i = 0; i < near.size(); ++i)
        EXPECT_LT((interpolate(map, i, values) - gradient * near[i]).norm(), 1e-12)
            << "point " << i;
    const std::vector<Vector3> far = random_points(2000, -3 * box_size, 4 * box_size);
    const BarycentricMap away = map_into(mesh, far, Outside::extrapolated);
    for (std::size_t i = 0; i < far.size(); ++i) {
        double sum = 0;
        for (const double w : away.weights[i]) {
            EXPECT_GE(w, min_extrapolated_weight - 1e-12) << "point " << i;
            sum += w;
        }
        EXPECT_NEAR(sum, 1, 1e-12) << "point " << i;
    }
}

TEST(BarycentricMap, stays_on_the_boundary_for_points_absurdly_far_away) {
    // At a distance of a thousand km, squared distances cannot distinguish neighbouring triangles;
    // the distance is still right.
    const TetMesh mesh = shapes::box(box_size, {5, 4, 3});
    const std::vector<Vector3> points{{1e6, 0.05, 0.04}};
    const BarycentricMap map = map_into(mesh, points);
    expect_convex_weights(map, 0);
    EXPECT_NEAR(map.distance[0], 1e6 - box_size.x(), 1e-6);
    EXPECT_NEAR(interpolate(map, 0, mesh.nodes).x(), box_size.x(), 1e-12);
}

TEST(BarycentricMap, finds_the_inside_of_a_body_with_a_gap) {
    // Two boxes 2 cm apart: the grid cells in between are empty, and the nearer box counts.
    TetMesh mesh = shapes::box({0.05, 0.05, 0.05}, {3, 3, 3});
    const TetMesh single = mesh;
    for (const Vector3& x : single.nodes) mesh.nodes.push_back(x + Vector3(0.07, 0, 0));
    const auto shift = static_cast<std::int32_t>(single.nodes.size());
    for (const Tet& t : single.tets)
        mesh.tets.push_back({t[0] + shift, t[1] + shift, t[2] + shift, t[3] + shift});
    const std::vector<Vector3> points{{0.055, 0.02, 0.03}, {0.066, 0.02, 0.03}, {0.08, 0.02, 0.03}};
    const BarycentricMap map = map_into(mesh, points);
    EXPECT_LT((interpolate(map, 0, mesh.nodes) - Vector3(0.05, 0.02, 0.03)).norm(), 1e-12);
    EXPECT_LT((interpolate(map, 1, mesh.nodes) - Vector3(0.07, 0.02, 0.03)).norm(), 1e-12);
    EXPECT_LT((interpolate(map, 2, mesh.nodes) - points[2]).norm(), 1e-12);
    EXPECT_NEAR(map.distance[1], 0.004, 1e-12);
}

TEST(BarycentricMap, gives_the_same_places_for_every_order_of_the_tets) {
    TetMesh mesh = shapes::box(box_size, {6, 5, 4});
    const std::vector<Vector3> points = random_points(500, -0.2 * box_size, 1.2 * box_size);
    const BarycentricMap before = map_into(mesh, points);
    std::shuffle(mesh.tets.begin(), mesh.tets.end(), std::mt19937(3));
    const BarycentricMap after = map_into(mesh, points);
    for (std::size_t i = 0; i < points.size(); ++i)
        EXPECT_LT((interpolate(before, i, mesh.nodes) - interpolate(after, i, mesh.nodes)).norm(),
                  1e-9);
}

TEST(BarycentricMap, refuses_an_empty_mesh_and_points_that_are_not_finite) {
    const std::vector<Vector3> points{{0, 0, std::nan("")}};
    EXPECT_THROW(map_into(TetMesh{}, points), Error);
    EXPECT_THROW(map_into(shapes::box(box_size, {1, 1, 1}), points), Error);
}

}  // namespace
}  // namespace livetet
