#include "meshing/quality.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <sstream>

#include "mesh/shapes.hpp"

namespace livetet {
namespace {

TEST(Quality, of_a_regular_tet_is_one) {
    const Vector3 a(1, 1, 1), b(1, -1, -1), c(-1, 1, -1), d(-1, -1, 1);
    EXPECT_NEAR(radius_ratio(a, b, c, d), 1, 1e-12);
    for (const double angle : dihedral_angles_deg(a, b, c, d))
        EXPECT_NEAR(angle, std::acos(1.0 / 3) * 180 / std::numbers::pi, 1e-10);
}

TEST(Quality, of_the_corner_of_a_cube_is_known) {
    // r_in = 1 / (3 + sqrt 3), r_circ = sqrt(3) / 2.
    const Vector3 o(0, 0, 0), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    EXPECT_NEAR(radius_ratio(o, x, y, z), 3 / (3 + std::sqrt(3.0)) / (std::sqrt(3.0) / 2), 1e-12);
    const auto angles = dihedral_angles_deg(o, x, y, z);
    for (int e = 0; e < 3; ++e) EXPECT_NEAR(angles[e], 90, 1e-10);
    for (int e = 3; e < 6; ++e)
        EXPECT_NEAR(angles[e], std::atan(std::sqrt(2.0)) * 180 / std::numbers::pi, 1e-10);
}

TEST(Quality, of_a_flat_tet_is_zero) {
    EXPECT_EQ(radius_ratio({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}), 0);
    EXPECT_EQ(radius_ratio({0, 0, 0}, {0, 0, 0}, {0, 1, 0}, {1, 1, 0}), 0);
    EXPECT_LT(radius_ratio({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1e-6}), 1e-5);
}

TEST(Quality, finds_the_worst_tet_and_its_place) {
    TetMesh mesh = shapes::box({0.1, 0.1, 0.1}, {4, 4, 4});
    // The middle node, nearly onto its neighbour.
    mesh.nodes[2 + 5 * (2 + 5 * 2)] += Vector3(0.02, 0, 0);
    const MeshQuality q = measure_quality(mesh);
    EXPECT_EQ(q.tets, 384);
    EXPECT_EQ(q.nodes, 125);
    EXPECT_EQ(q.boundary_triangles, 192);
    EXPECT_NEAR(q.volume_m3, 1e-3, 1e-12);
    EXPECT_NEAR(q.min_edge_m, 0.005, 1e-12);
    EXPECT_LT((q.worst.front().place - Vector3(0.07, 0.05, 0.05)).norm(), 0.02);
    EXPECT_LT(q.min_radius_ratio,
              0.6 * measure_quality(shapes::box({0.1, 0.1, 0.1}, {4, 4, 4})).min_radius_ratio);
}

TEST(Quality, counts_every_angle_once_and_lists_the_worst_first) {
    TetMesh mesh = shapes::box({0.1, 0.1, 0.1}, {4, 4, 4});
    mesh.nodes[2 + 5 * (2 + 5 * 2)] += Vector3(0.02, 0, 0);
    const MeshQuality q = measure_quality(mesh);
    EXPECT_EQ(std::accumulate(q.dihedral_counts.begin(), q.dihedral_counts.end(), std::int64_t{0}),
              6 * q.tets);
    ASSERT_EQ(q.worst.size(), MeshQuality::worst_listed);
    EXPECT_EQ(q.worst.front().min_dihedral_deg, q.min_dihedral_deg);
    EXPECT_TRUE(std::is_sorted(q.worst.begin(), q.worst.end(), [](const auto& a, const auto& b) {
        return a.min_dihedral_deg < b.min_dihedral_deg;
    }));
    // A Kuhn tet has only dihedral angles of 45, 60 and 90 degrees.
    const MeshQuality regular = measure_quality(shapes::box({1, 1, 1}, {3, 3, 3}));
    EXPECT_NEAR(regular.min_dihedral_deg, 45, 1e-9);
    EXPECT_EQ(regular.dihedral_counts[0] + regular.dihedral_counts[3] + regular.dihedral_counts[10],
              0);
}

TEST(Quality, table_lines_up) {
    const std::vector<MeshQuality> levels{
        measure_quality(shapes::box({0.15, 0.11, 0.08}, {20, 20, 20})),
        measure_quality(shapes::box({0.15, 0.11, 0.08}, {2, 2, 2}))};
    std::istringstream lines(quality_table(levels));
    std::string line;
    std::vector<std::size_t> widths;
    while (std::getline(lines, line)) widths.push_back(line.size());
    ASSERT_EQ(widths.size(), 3u);
    EXPECT_EQ(widths[1], widths[0]);
    EXPECT_EQ(widths[2], widths[0]);
}

}  // namespace
}  // namespace livetet
