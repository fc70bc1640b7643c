#include "apps/verification/meshes.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <functional>
#include <numbers>

#include "base/error.hpp"

namespace livetet::verification {
namespace {

Vector3 area_vector(const TetMesh& mesh, const Triangle& t) {
    return (mesh.nodes[t[1]] - mesh.nodes[t[0]]).cross(mesh.nodes[t[2]] - mesh.nodes[t[0]]) / 2;
}

double area(const TetMesh& mesh, const std::string& face) {
    double sum = 0;
    for (const Triangle& t : mesh.triangle_sets.at(face)) sum += area_vector(mesh, t).norm();
    return sum;
}

/// What each mesh promises: it holds together, each triangle of its boundary is in one set, as the
/// boundary winds it (outwards), and the node sets are the triangles' nodes.
void expect_sound(const TetMesh& mesh, std::size_t faces) {
    EXPECT_NO_THROW(check_tet_mesh(mesh, "mesh"));
    EXPECT_EQ(mesh.triangle_sets.size(), faces);
    std::vector<Triangle> named, boundary = boundary_triangles(mesh.tets);
    double flux = 0;  // of x/3 through the boundary: the volume, if all windings are outwards
    for (const auto& [name, triangles] : mesh.triangle_sets) {
        named.insert(named.end(), triangles.begin(), triangles.end());
        EXPECT_EQ(mesh.node_sets.at(name), nodes_of(triangles)) << name;
        for (const Triangle& t : triangles)
            flux +=
                area_vector(mesh, t).dot(mesh.nodes[t[0]] + mesh.nodes[t[1]] + mesh.nodes[t[2]]) /
                9;
    }
    std::sort(named.begin(), named.end());
    std::sort(boundary.begin(), boundary.end());
    EXPECT_EQ(named, boundary);
    EXPECT_NEAR(flux, volume(mesh), 1e-12 * volume(mesh));
}

/// Each face named for an axis lies exactly in its plane, and its normals leave the body.
void expect_flat(const TetMesh& mesh, const std::string& face, int axis, double at,
                 double outwards) {
    for (const std::int32_t n : mesh.node_sets.at(face)) EXPECT_EQ(mesh.nodes[n][axis], at) << face;
    for (const Triangle& t : mesh.triangle_sets.at(face))
        EXPECT_GT(outwards * area_vector(mesh, t)[axis], 0.999 * area_vector(mesh, t).norm())
            << face;
}

/// The error of a measure falls to a quarter with twice the counts.
void expect_second_order(const std::function<double(int)>& measure, double exact) {
    const double coarse = measure(4) - exact, fine = measure(8) - exact;
    EXPECT_NEAR(coarse / fine, 4, 0.2) << coarse << " " << fine;
}

TEST(VerificationMeshes, BoxFillsItself) {
    const TetMesh mesh = box({2, 3, 0.5}, {2, 4, 1});
    expect_sound(mesh, 6);
    EXPECT_EQ(mesh.tets.size(), 6u * 2 * 4);
    EXPECT_NEAR(volume(mesh), 3, 1e-12);
    EXPECT_NEAR(area(mesh, "y1"), 1, 1e-12);
    expect_flat(mesh, "x0", 0, 0, -1);
    expect_flat(mesh, "x1", 0, 2, 1);
    expect_flat(mesh, "y0", 1, 0, -1);
    expect_flat(mesh, "y1", 1, 3, 1);
    expect_flat(mesh, "z0", 2, 0, -1);
    expect_flat(mesh, "z1", 2, 0.5, 1);
}

TEST(VerificationMeshes, DistortionMovesInnerNodesOnly) {
    const TetMesh plain = box({1, 2, 3}, {4, 4, 4}), bent = box({1, 2, 3}, {4, 4, 4}, 0.2);
    expect_sound(bent, 6);
    EXPECT_EQ(bent.nodes, box({1, 2, 3}, {4, 4, 4}, 0.2).nodes);
    EXPECT_EQ(bent.triangle_sets, plain.triangle_sets);
    EXPECT_NEAR(volume(bent), 6, 1e-12);
    int moved = 0;
    for (std::size_t n = 0; n < plain.nodes.size(); ++n) moved += bent.nodes[n] != plain.nodes[n];
    EXPECT_EQ(moved, 3 * 3 * 3);
    EXPECT_NO_THROW(box({1, 1, 1}, {16, 16, 16}, 0.2));
    EXPECT_THROW(box({1, 1, 1}, {8, 8, 8}, 0.8), Error);
}

TEST(VerificationMeshes, SphereOctantConverges) {
    const auto mesh = [](int n) { return sphere_octant(1, 2, n, n / 2); };
    expect_sound(mesh(3), 5);
    expect_sound(mesh(8), 5);
    EXPECT_EQ(mesh(8).tets.size(), 3u * 8 * 8 * 4);
    for (int axis = 0; axis < 3; ++axis)
        expect_flat(mesh(5), std::array{"x0", "y0", "z0"}[axis], axis, 0, -1);
    const TetMesh five = mesh(5);
    for (const std::int32_t n : five.node_sets.at("outer"))
        EXPECT_NEAR(five.nodes[n].norm(), 2, 1e-15);
    expect_second_order([&](int n) { return volume(mesh(n)); }, std::numbers::pi / 6 * 7);
    expect_second_order([&](int n) { return area(mesh(n), "inner"); }, std::numbers::pi / 2);
    expect_second_order([&](int n) { return area(mesh(n), "outer"); }, 2 * std::numbers::pi);
    expect_second_order([&](int n) { return area(mesh(n), "y0"); }, std::numbers::pi / 4 * 3);
}

TEST(VerificationMeshes, SphereOctantHasTrianglesOfLikeSize) {
    const TetMesh mesh = sphere_octant(1, 2, 16, 8);
    double smallest = 1e9, largest = 0;
    for (const Triangle& t : mesh.triangle_sets.at("outer")) {
        const double a = area_vector(mesh, t).norm();
        smallest = std::min(smallest, a), largest = std::max(largest, a);
    }
    EXPECT_LT(largest / smallest, 2);  // normalising barycentric coordinates as they are: above 4
}

TEST(VerificationMeshes, CylinderQuarterConverges) {
    const auto mesh = [](int n) { return cylinder_quarter(1, 2, 0.5, n / 2, n, 2); };
    expect_sound(mesh(4), 6);
    expect_flat(mesh(5), "x0", 0, 0, -1);
    expect_flat(mesh(5), "y0", 1, 0, -1);
    expect_flat(mesh(5), "z0", 2, 0, -1);
    expect_flat(mesh(5), "z1", 2, 0.5, 1);
    expect_second_order([&](int n) { return volume(mesh(n)); }, std::numbers::pi / 4 * 3 * 0.5);
    expect_second_order([&](int n) { return area(mesh(n), "inner"); }, std::numbers::pi / 2 * 0.5);
    expect_second_order([&](int n) { return area(mesh(n), "z1"); }, std::numbers::pi / 4 * 3);
    EXPECT_NEAR(area(mesh(4), "x0"), 0.5, 1e-12);
}

TEST(VerificationMeshes, CooksMembraneHasItsCorners) {
    const TetMesh mesh = cooks_membrane(4, 2, 1.5);
    expect_sound(mesh, 6);
    EXPECT_NEAR(volume(mesh), 48 * (44 + 16) / 2 * 1.5, 1e-9);
    EXPECT_NEAR(area(mesh, "left"), 44 * 1.5, 1e-9);
    EXPECT_NEAR(area(mesh, "right"), 16 * 1.5, 1e-9);
    EXPECT_NEAR(area(mesh, "top"), std::hypot(48, 16) * 1.5, 1e-9);
    EXPECT_NEAR(area(mesh, "bottom"), std::hypot(48, 44) * 1.5, 1e-9);
    expect_flat(mesh, "left", 0, 0, -1);
    expect_flat(mesh, "right", 0, 48, 1);
    expect_flat(mesh, "z0", 2, 0, -1);
    expect_flat(mesh, "z1", 2, 1.5, 1);
}

TEST(VerificationMeshes, LE10PlateConvergesAndHasItsMiddleLine) {
    const auto mesh = [](int n) { return le10_plate(n / 2, n, 2); };
    expect_sound(mesh(4), 6);
    expect_flat(mesh(6), "x0", 0, 0, -1);
    expect_flat(mesh(6), "y0", 1, 0, -1);
    expect_flat(mesh(6), "top", 2, 0.3, 1);
    expect_flat(mesh(6), "bottom", 2, -0.3, -1);
    const double quarter_ring = std::numbers::pi / 4 * (3.25 * 2.75 - 2 * 1);
    expect_second_order([&](int n) { return volume(mesh(n)); }, 0.6 * quarter_ring);
    expect_second_order([&](int n) { return area(mesh(n), "top"); }, quarter_ring);
    const TetMesh fine = le10_plate(3, 6, 4);
    EXPECT_EQ(fine.node_sets.at("outer_middle").size(), 7u);
    for (const std::int32_t n : fine.node_sets.at("outer_middle")) {
        const Vector3& x = fine.nodes[n];
        EXPECT_NEAR(std::pow(x.x() / 3.25, 2) + std::pow(x.y() / 2.75, 2), 1, 1e-14);
        EXPECT_NEAR(x.z(), 0, 1e-15);
    }
    EXPECT_EQ(std::count(fine.nodes.begin(), fine.nodes.end(), Vector3(2, 0, 0.3)), 1);
    EXPECT_THROW(le10_plate(3, 6, 3), Error);
}

TEST(VerificationMeshes, HalfTheCountsIsALevelOfTheSameNodes) {
    const auto subset = [](const TetMesh& coarse, const TetMesh& fine) {
        return std::all_of(coarse.nodes.begin(), coarse.nodes.end(), [&](const Vector3& x) {
            return std::any_of(fine.nodes.begin(), fine.nodes.end(),
                               [&](const Vector3& y) { return (x - y).norm() < 1e-12; });
        });
    };
    EXPECT_TRUE(subset(sphere_octant(1, 2, 3, 2), sphere_octant(1, 2, 6, 4)));
    EXPECT_TRUE(subset(cylinder_quarter(1, 2, 1, 2, 3, 1), cylinder_quarter(1, 2, 1, 4, 6, 2)));
    EXPECT_TRUE(subset(le10_plate(2, 3, 2), le10_plate(4, 6, 4)));
}

TEST(VerificationMeshes, NoCellsAreAnError) {
    EXPECT_THROW(cylinder_quarter(1, 2, 1, 2, 0, 1), Error);
}

}  // namespace
}  // namespace livetet::verification
