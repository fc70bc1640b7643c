#include "mesh/quadratic_hexahedra.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <algorithm>
#include <numbers>

#include "base/error.hpp"
#include "mesh/quadratic_faces.hpp"

namespace livetet {
namespace {

/// Two unit cubes beside each other, the second one turned by a quarter about x.
TetMesh two_cubes() {
    TetMesh mesh;
    for (int n = 0; n < 12; ++n) mesh.nodes.emplace_back(n % 3, n / 3 % 2, n / 6);
    std::vector<QuadraticHexahedron> cells(2);
    for (auto& cell : cells) cell.fill(-1);
    const auto node = [](int i, int j, int k) { return i + 3 * j + 6 * k; };
    for (int c = 0; c < 8; ++c) {
        const int i = c & 1, j = c >> 1 & 1, k = c >> 2 & 1;
        cells[0][quadratic_corner(c)] = node(i, j, k);
        cells[1][quadratic_corner(c)] = node(1 + i, 1 - k, j);
    }
    mesh.node_sets["left"] = {0, 3, 6, 9};
    mesh.triangle_sets["top"] = {{6, 7, 10}, {6, 10, 9}};
    mesh.node_sets["top"] = {6, 7, 9, 10};
    return quadratic_hexahedra(std::move(mesh), std::move(cells), std::vector<std::int32_t>{4, 7},
                               "two cubes");
}

/// A quarter of a ring, 1 <= r <= 2, 0 <= z <= 1, its edges bent: `n` cells around it.
TetMesh quarter_ring(int n) {
    TetMesh mesh;
    const int around = 2 * n + 1;
    for (int k = 0; k < 3; ++k)
        for (int j = 0; j < around; ++j)
            for (int i = 0; i < 3; ++i) {
                const double angle = std::numbers::pi / 2 * j / (around - 1), r = 1 + i / 2.0;
                mesh.nodes.emplace_back(r * std::cos(angle), r * std::sin(angle), k / 2.0);
            }
    std::vector<QuadraticHexahedron> cells(n);
    for (int c = 0; c < n; ++c)
        for (int p = 0; p < 27; ++p)
            cells[c][p] = p % 3 + 3 * (2 * c + p / 3 % 3 + around * (p / 9));
    return quadratic_hexahedra(std::move(mesh), std::move(cells), {}, "ring");
}

TEST(QuadraticHexahedra, NeighboursShareTheMiddlesOfTheirFace) {
    const TetMesh mesh = two_cubes();
    EXPECT_EQ(mesh.nodes.size(), 45u);  // 5 x 3 x 3
    EXPECT_EQ(mesh.tets.size(), 2 * tets_per_quadratic_hexahedron);
    EXPECT_NO_THROW(check_tet_mesh(mesh, "two cubes"));
    EXPECT_NEAR(volume(mesh), 2, 1e-14);
    // No triangle between them: their common face is divided in the same way by both.
    const auto boundary = boundary_triangles(mesh.tets);
    EXPECT_EQ(boundary.size(), 10u * 8);
    EXPECT_EQ(std::count(mesh.regions.begin(), mesh.regions.end(), 4), 48);
    EXPECT_EQ(mesh.regions.back(), 7);
    for (const auto& cell : mesh.quadratic_hexahedra)
        for (int p = 0; p < 27; ++p) {
            const Vector3 at(p % 3 / 2.0, p / 3 % 3 / 2.0, p / 9 / 2.0);
            const Vector3 there = mesh.nodes[cell[p]];
            const bool is_first = &cell == &mesh.quadratic_hexahedra.front();
            EXPECT_EQ(there, is_first ? at : Vector3(1 + at.x(), 1 - at.z(), at.y())) << p;
        }
}

TEST(QuadraticHexahedra, SetsGetTheMiddlesOfWhatTheyHold) {
    const TetMesh mesh = two_cubes();
    EXPECT_EQ(mesh.node_sets.at("left").size(), 9u);
    for (const std::int32_t n : mesh.node_sets.at("left")) EXPECT_EQ(mesh.nodes[n].x(), 0);
    const auto& top = mesh.triangle_sets.at("top");
    EXPECT_EQ(top.size(), 8u);
    EXPECT_EQ(mesh.node_sets.at("top"), nodes_of(top));
    for (const Triangle& t : top)
        EXPECT_GT(
            (mesh.nodes[t[1]] - mesh.nodes[t[0]]).cross(mesh.nodes[t[2]] - mesh.nodes[t[0]]).z(),
            0);
}

TEST(QuadraticHexahedra, MiddlesOfBentFacesLieOnThem) {
    // Given edges bent by a quadratic map, the face's and the cell's middle are where it has them.
    const auto map = [](const Vector3& x) {
        return Vector3(x.x() + 0.1 * x.y() * x.y(), x.y() + 0.2 * x.x() * x.z(), x.z());
    };
    TetMesh mesh;
    QuadraticHexahedron cell;
    for (int p = 0; p < 27; ++p) {
        const Vector3 at(p % 3 / 2.0, p / 3 % 3 / 2.0, p / 9 / 2.0);
        const bool is_given = (at.array() == 0.5).count() < 2;
        cell[p] = is_given ? static_cast<std::int32_t>(mesh.nodes.size()) : -1;
        if (is_given) mesh.nodes.push_back(map(at));
    }
    EXPECT_EQ(mesh.nodes.size(), 20u);
    mesh = quadratic_hexahedra(std::move(mesh), {cell}, {}, "one");
    const auto& made = mesh.quadratic_hexahedra.front();
    for (int p = 0; p < 27; ++p)
        EXPECT_LT((mesh.nodes[made[p]] - map({p % 3 / 2.0, p / 3 % 3 / 2.0, p / 9 / 2.0})).norm(),
                  1e-15)
            << p;
}

TEST(QuadraticHexahedra, GridKeepsItsNodesSharesAndSets) {
    TetMesh grid;
    for (int n = 0; n < 12; ++n) grid.nodes.emplace_back(n % 3, n / 3 % 2, n / 6);
    grid.hexahedra = {{0, 1, 3, 4, 6, 7, 9, 10}, {1, 2, 4, 5, 7, 8, 10, 11}};
    grid.shares = {1, 0.25};
    grid.node_sets["left"] = {0, 3, 6, 9};
    const TetMesh mesh = quadratic_grid(grid);
    EXPECT_EQ(mesh.nodes.size(), 45u);
    EXPECT_TRUE(std::equal(grid.nodes.begin(), grid.nodes.end(), mesh.nodes.begin()));
    EXPECT_EQ(mesh.shares, grid.shares);
    EXPECT_TRUE(mesh.hexahedra.empty());
    EXPECT_EQ(mesh.node_sets.at("left").size(), 9u);
}

/// A plate of 2 x 1 cells, one cell thick, its corners alone or with all nodes given.
struct Plate {
    TetMesh mesh;
    std::vector<QuadraticHexahedron> cells{2};

    explicit Plate(bool has_middles) {
        const int step = has_middles ? 1 : 2;  // between nodes, in halves of a cell
        const int nx = 4 / step + 1, n = 2 / step + 1;
        for (int k = 0; k < n; ++k)
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < nx; ++i) mesh.nodes.push_back(Vector3(i, j, k) * step / 2);
        for (int c = 0; c < 2; ++c)
            for (int p = 0; p < 27; ++p) {
                const int at[3] = {2 * c + p % 3, p / 3 % 3, p / 9};
                const bool is_node =
                    has_middles || (at[0] % 2 == 0 && at[1] % 2 == 0 && at[2] % 2 == 0);
                cells[c][p] =
                    is_node ? at[0] / step + nx * (at[1] / step + n * (at[2] / step)) : -1;
            }
        for (const auto& cell : cells)
            for (const int side : {0, 4}) {
                const auto corner = [&](int c) { return cell[quadratic_corner(side + c)]; };
                mesh.triangle_sets["skin"].push_back({corner(0), corner(1), corner(3)});
                mesh.triangle_sets["skin"].push_back({corner(0), corner(3), corner(2)});
            }
    }
};

/// The two large faces hold all corners, but not what is between the faces.
TEST(QuadraticHexahedra, FacesOfAThinBodyDoNotGrowIntoIt) {
    for (const bool has_middles : {false, true}) {
        Plate plate(has_middles);
        const TetMesh mesh =
            quadratic_hexahedra(std::move(plate.mesh), std::move(plate.cells), {}, "plate");
        ASSERT_EQ(mesh.nodes.size(), 45u);
        EXPECT_EQ(mesh.node_sets.at("skin").size(), 30u);
        EXPECT_EQ(mesh.triangle_sets.at("skin").size(), 32u);
        for (const std::int32_t n : mesh.node_sets.at("skin")) EXPECT_NE(mesh.nodes[n].z(), 0.5);
    }
    Plate plate(true);
    plate.mesh.triangle_sets.clear();
    for (std::int32_t n = 0; n < 45; ++n)
        if (plate.mesh.nodes[n].z() != 0.5) plate.mesh.node_sets["skin"].push_back(n);
    const TetMesh mesh =
        quadratic_hexahedra(std::move(plate.mesh), std::move(plate.cells), {}, "plate");
    EXPECT_EQ(mesh.node_sets.at("skin").size(), 30u) << "a file's own nodes are not added";
}

TEST(QuadraticHexahedra, AFaceInsideKeepsItsNodes) {
    Plate plate(false);
    plate.mesh.triangle_sets.clear();
    const auto corner = [&](int c) { return plate.cells[0][quadratic_corner(c)]; };
    plate.mesh.triangle_sets["middle"] = {{corner(1), corner(3), corner(7)}};
    const TetMesh mesh =
        quadratic_hexahedra(std::move(plate.mesh), std::move(plate.cells), {}, "plate");
    EXPECT_FALSE(mesh.triangle_sets.contains("middle"));
    EXPECT_EQ(mesh.node_sets.at("middle").size(), 9u);
    for (const std::int32_t n : mesh.node_sets.at("middle")) EXPECT_EQ(mesh.nodes[n].x(), 1);
}

/// A cell of 8 nodes beside one of 27 takes the middles of their common face.
TEST(QuadraticHexahedra, CellsOfDifferentNumbersOfNodesHangTogether) {
    Plate plate(true);
    plate.mesh.triangle_sets.clear();
    for (int p = 0; p < 27; ++p) {
        const bool is_corner = p % 3 != 1 && p / 3 % 3 != 1 && p / 9 != 1;
        const bool is_shared = p % 3 == 0;
        if (!is_corner && is_shared) plate.cells[1][p] = -1;
    }
    const TetMesh mesh =
        quadratic_hexahedra(std::move(plate.mesh), std::move(plate.cells), {}, "plate");
    EXPECT_EQ(mesh.nodes.size(), 45u);
    EXPECT_EQ(boundary_triangles(mesh.tets).size(), 10u * 8);
}

TEST(QuadraticHexahedra, WhatIsFlatOrTurnedOverIsRefusedByPlace) {
    TetMesh mesh = two_cubes();
    mesh.nodes[mesh.quadratic_hexahedra[1][quadratic_corner(7)]] = mesh.nodes[1];
    try {
        check_quadratic_mesh(mesh, "file");
        FAIL() << "expected an Error";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("file: hexahedron 1 is flat or turned over at ("),
                  std::string::npos)
            << error.what();
    }
    mesh = two_cubes();
    mesh.quadratic_hexahedra[0][13] = 99;
    EXPECT_THROW(check_quadratic_mesh(mesh, "file"), Error);
    mesh = two_cubes();
    mesh.nodes[3].x() = NAN;
    EXPECT_THROW(check_quadratic_mesh(mesh, "file"), Error);
    for (const double share : {0.0, 1.5, static_cast<double>(NAN)}) {
        mesh = two_cubes();
        mesh.shares = {1, share};
        EXPECT_THROW(check_quadratic_mesh(mesh, "file"), Error) << share;
    }
    EXPECT_THROW(quadratic_hexahedra({}, {}, {}, "file"), Error);
    mesh = two_cubes();
    mesh.quadratic_hexahedra[1] = mesh.quadratic_hexahedra[0];
    EXPECT_THROW(check_quadratic_mesh(mesh, "file"), Error) << "twice the same";
    Plate plate(true);
    plate.cells.push_back(plate.cells[1]);
    for (int p = 0; p < 27; ++p)  // a third cell at the common face
        if (p % 3 != 0) {
            plate.cells[2][p] = static_cast<std::int32_t>(plate.mesh.nodes.size());
            plate.mesh.nodes.push_back(plate.mesh.nodes[plate.cells[1][p]]);
        }
    plate.mesh.quadratic_hexahedra = plate.cells;
    EXPECT_THROW(check_quadratic_mesh(plate.mesh, "file"), Error);
}

/// The Jacobian is checked between the nodes, too: of a cell where it is positive at all of these.
TEST(QuadraticHexahedra, WhatIsTurnedOverBetweenItsNodesIsRefused) {
    std::uint32_t state = 1;
    const auto random = [&] {
        return (state = state * 1664525u + 1013904223u) / 4294967296.0 - 0.5;
    };
    int found = 0;
    for (int trial = 0; trial < 20000 && found == 0; ++trial) {
        Plate plate(true);
        plate.mesh.quadratic_hexahedra = {plate.cells[0]};
        for (Vector3& x : plate.mesh.nodes)
            for (double& c : x) c += 0.35 * random();
        Eigen::Matrix<double, 3, 27> x;
        for (int p = 0; p < 27; ++p) x.col(p) = plate.mesh.nodes[plate.cells[0][p]];
        const auto jacobian = [&](const Vector3& at) {
            return Eigen::Matrix3d(x * quadratic_slopes(at).transpose()).determinant();
        };
        bool is_good_at_nodes = true, is_good_at_points = true;
        for (int p = 0; p < 27; ++p) {
            const Vector3 at(p % 3 / 2.0, p / 3 % 3 / 2.0, p / 9 / 2.0);
            is_good_at_nodes = is_good_at_nodes && jacobian(at) > 1e-6;
            is_good_at_points = is_good_at_points &&
                                jacobian(Vector3::Constant(0.5) +
                                         std::sqrt(0.6) * (at - Vector3::Constant(0.5))) > -1e-6;
        }
        if (!is_good_at_nodes || is_good_at_points) continue;
        ++found;
        EXPECT_THROW(check_quadratic_mesh(plate.mesh, "file"), Error);
    }
    EXPECT_EQ(found, 1) << "a cell to try";
}

TEST(QuadraticHexahedra, ShapeFunctionsAreThoseOfTheirNodes) {
    for (int p = 0; p < 27; ++p) {
        const auto values = quadratic_shape({p % 3 / 2.0, p / 3 % 3 / 2.0, p / 9 / 2.0});
        for (int q = 0; q < 27; ++q) EXPECT_EQ(values[q], p == q) << p << " " << q;
    }
    const Vector3 x(0.2, 0.7, 0.4);
    const auto slopes = quadratic_slopes(x);
    constexpr double h = 1e-6;
    for (int d = 0; d < 3; ++d) {
        const Vector3 step = h * Vector3::Unit(d);
        const Eigen::Matrix<double, 27, 1> difference =
            (quadratic_shape(x + step) - quadratic_shape(x - step)) / (2 * h);
        EXPECT_LT((slopes.row(d).transpose() - difference).norm(), 1e-9);
    }
}

/// Of all outer triangles: the sums of area vectors, of curved area and of the flux of x / 3.
struct Sums {
    Vector3 area = Vector3::Zero();
    double curved = 0, flux = 0;
};
Sums sums(const TetMesh& mesh, double at_radius) {
    const auto boundary = boundary_triangles(mesh.tets);
    const QuadraticFaces faces(mesh, boundary);
    Sums sums;
    for (const Triangle& t : boundary)
        for (const FacePoint& p : faces.points(mesh, t)) {
            sums.area += p.area;
            sums.flux += p.area.dot(p.place) / 3;
            if (std::abs(p.place.head<2>().norm() - at_radius) < 0.02 &&
                std::abs(p.area.z()) < 1e-12)
                sums.curved += p.area.norm();
        }
    return sums;
}

TEST(QuadraticFaces, AreOutwardsAndFollowTheBend) {
    const Sums flat = sums(two_cubes(), -1);
    EXPECT_LT(flat.area.norm(), 1e-14);
    EXPECT_NEAR(flat.flux, 2, 1e-13);
    const double outer = std::numbers::pi;  // a quarter of 2 pi r h
    double before = 0;
    for (const int n : {2, 4}) {
        const TetMesh ring = quarter_ring(n);
        const Sums bent = sums(ring, 2);
        EXPECT_LT(bent.area.norm(), 1e-13);
        const double error = std::abs(bent.curved - outer);
        if (n == 4) {
            EXPECT_GT(before / error, 12) << before << " " << error;  // order 4
        }
        before = error;
    }
}

TEST(QuadraticFaces, TrianglesOfNoFaceAreRefused) {
    const TetMesh mesh = two_cubes();
    const std::vector<Triangle> corners{{0, 1, 3}};
    EXPECT_THROW((void)QuadraticFaces(mesh, corners).points(mesh, corners[0]), Error);
}

}  // namespace
}  // namespace livetet
