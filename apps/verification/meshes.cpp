#include "apps/verification/meshes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>

#include "base/error.hpp"
#include "mesh/quadratic_hexahedra.hpp"
#include "mesh/shapes.hpp"

namespace livetet::verification {
namespace {

/// A face of the unit cube (or of a prism in it): the points xi with normal . xi = offset. Normals
/// of 0, 1 and -1, so that the comparison is exact for the nodes of a grid.
struct Face {
    std::string name;
    Vector3 normal;
    double offset;

    bool holds(const Vector3& xi) const { return normal.dot(xi) == offset; }
};

using Names = std::array<std::string, 6>;

/// The six faces of the unit cube: xi_0 = 0, xi_0 = 1, xi_1 = 0, and so on.
std::vector<Face> cube_faces(const Names& names) {
    std::vector<Face> faces;
    for (int f = 0; f < 6; ++f)
        faces.push_back({names[f], Vector3::Unit(f / 2), static_cast<double>(f % 2)});
    return faces;
}

TetMesh unit_cube(Cells cells) {
    for (const int n : cells)
        if (n < 1)
            fail("a mesh of {} x {} x {} cells, expected at least 1 each way", cells[0], cells[1],
                 cells[2]);
    return shapes::box(Vector3::Ones(), cells);
}

/// Assigns the boundary's triangles to the faces that contain all three nodes.
void name_faces(TetMesh& mesh, const std::vector<Face>& faces) {
    for (const Triangle& t : boundary_triangles(mesh.tets)) {
        const auto face = std::find_if(faces.begin(), faces.end(), [&](const Face& f) {
            return std::all_of(t.begin(), t.end(),
                               [&](std::int32_t n) { return f.holds(mesh.nodes[n]); });
        });
        if (face != faces.end()) mesh.triangle_sets[face->name].push_back(t);
    }
    for (const auto& [name, triangles] : mesh.triangle_sets)
        mesh.node_sets[name] = nodes_of(triangles);
}

/// The named unit cube with each node moved to map(xi), which must keep the orientation.
template <class Map>
TetMesh mapped_cube(Cells cells, const Names& names, Map&& map) {
    TetMesh mesh = unit_cube(cells);
    name_faces(mesh, cube_faces(names));
    for (Vector3& x : mesh.nodes) x = map(x);
    return mesh;
}

/// Removes the tets for which `outside` holds at any node, and nodes without a tet.
template <class Outside>
void cut(TetMesh& mesh, Outside&& outside) {
    std::erase_if(mesh.tets, [&](const Tet& t) {
        return std::any_of(t.begin(), t.end(),
                           [&](std::int32_t n) { return outside(mesh.nodes[n]); });
    });
    std::vector<std::int32_t> new_number(mesh.nodes.size(), -1);
    std::vector<Vector3> kept;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        if (outside(mesh.nodes[n])) continue;
        new_number[n] = static_cast<std::int32_t>(kept.size());
        kept.push_back(mesh.nodes[n]);
    }
    mesh.nodes = std::move(kept);
    for (Tet& t : mesh.tets)
        for (std::int32_t& n : t) n = new_number[n];
}

/// (cos, sin) of s quarter turns, exactly on the axes at s = 0 and s = 1.
Eigen::Vector2d direction(double s) {
    return {std::sin((1 - s) * std::numbers::pi / 2), std::sin(s * std::numbers::pi / 2)};
}

double between(double a, double b, double s) { return (1 - s) * a + s * b; }

}  // namespace

TetMesh box(const Vector3& size, Cells cells, double distortion) {
    TetMesh mesh = mapped_cube(cells, {"x0", "x1", "y0", "y1", "z0", "z1"},
                               [&](const Vector3& xi) -> Vector3 { return xi.cwiseProduct(size); });
    if (distortion == 0) return mesh;
    std::vector<bool> inner(mesh.nodes.size(), true);
    for (const auto& [name, nodes] : mesh.node_sets)
        for (const std::int32_t n : nodes) inner[n] = false;
    std::mt19937 generator(1);
    const auto random = [&] {
        return 2 * (static_cast<double>(generator()) / std::mt19937::max()) - 1;
    };
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        for (int c = 0; c < 3; ++c)
            if (inner[n]) mesh.nodes[n][c] += distortion * random() * size[c] / cells[c];
    check_tet_mesh(mesh, "the distorted box");
    return mesh;
}

namespace {

/// Hexahedra of `step` bricks along each axis, of the mesh's nodes that are at whole halves of
/// `step`; -1 elsewhere.
std::vector<QuadraticHexahedron> hexahedra_of(Cells bricks, int step) {
    std::vector<QuadraticHexahedron> cells;
    for (int k = 0; k < bricks[2]; k += step)
        for (int j = 0; j < bricks[1]; j += step)
            for (int i = 0; i < bricks[0]; i += step) {
                QuadraticHexahedron& cell = cells.emplace_back();
                for (int n = 0; n < 27; ++n) {
                    const int at[3] = {step * (n % 3), step * (n / 3 % 3), step * (n / 9)};
                    const bool is_there = at[0] % 2 == 0 && at[1] % 2 == 0 && at[2] % 2 == 0;
                    cell[n] = !is_there ? -1
                                        : i + at[0] / 2 +
                                              (bricks[0] + 1) * (j + at[1] / 2 +
                                                                 (bricks[1] + 1) * (k + at[2] / 2));
                }
            }
    return cells;
}

}  // namespace

TetMesh straight_hexahedra(TetMesh mesh, Cells bricks) {
    return quadratic_hexahedra(std::move(mesh), hexahedra_of(bricks, 1), {}, "hexahedra");
}

TetMesh bent_hexahedra(TetMesh mesh, Cells bricks) {
    for (const int n : bricks)
        if (n % 2 != 0)
            fail("hexahedra of {} x {} x {} bricks, expected even numbers", bricks[0], bricks[1],
                 bricks[2]);
    std::map<std::string, std::vector<Triangle>> faces;
    std::swap(faces, mesh.triangle_sets);  // of bricks
    TetMesh made = quadratic_hexahedra(std::move(mesh), hexahedra_of(bricks, 2), {}, "hexahedra");
    const std::vector<Triangle> boundary = boundary_triangles(made.tets);
    for (const auto& [name, of_bricks] : faces) {
        const std::vector<std::int32_t>& nodes = made.node_sets.at(name);
        for (const Triangle& t : boundary)
            if (std::ranges::all_of(
                    t, [&](std::int32_t n) { return std::ranges::binary_search(nodes, n); }))
                made.triangle_sets[name].push_back(t);
    }
    return made;
}

TetMesh sphere_octant(double a, double b, int n_surface, int n_radial) {
    // The half of the cube with xi_1 <= xi_0, a prism: barycentric (1 - xi_0, xi_0 - xi_1, xi_1),
    // outwards along xi_2. Kuhn's tets do not cross the plane xi_0 = xi_1.
    TetMesh mesh = unit_cube({n_surface, n_surface, n_radial});
    cut(mesh, [](const Vector3& xi) { return xi[1] > xi[0]; });
    name_faces(mesh, {{"x0", {1, 0, 0}, 1},
                      {"y0", {1, -1, 0}, 0},
                      {"z0", {0, 1, 0}, 0},
                      {"inner", {0, 0, 1}, 0},
                      {"outer", {0, 0, 1}, 1}});
    for (Vector3& x : mesh.nodes) {
        const Vector3 barycentric(1 - x[0], x[0] - x[1], x[1]);
        const Vector3 d = (barycentric * std::numbers::pi / 2).array().sin();
        x = between(a, b, x[2]) * d.normalized();
    }
    return mesh;
}

TetMesh cylinder_quarter(double a, double b, double height, int n_r, int n_theta, int n_z) {
    return mapped_cube({n_r, n_theta, n_z}, {"inner", "outer", "y0", "x0", "z0", "z1"},
                       [&](const Vector3& xi) {
                           const Eigen::Vector2d p = between(a, b, xi[0]) * direction(xi[1]);
                           return Vector3(p.x(), p.y(), height * xi[2]);
                       });
}

TetMesh cooks_membrane(int n, int n_z, double thickness) {
    // Two axes of the cube are reversed, which keeps the orientation: the bricks' diagonals become
    // the short ones.
    return mapped_cube(
        {n, n, n_z}, {"left", "right", "top", "bottom", "z1", "z0"}, [&](const Vector3& xi) {
            const double bottom = 44 * xi[0], top = between(44, 60, xi[0]);
            return Vector3(48 * xi[0], between(bottom, top, 1 - xi[1]), thickness * (1 - xi[2]));
        });
}

TetMesh le10_plate(int n_r, int n_theta, int n_z) {
    if (n_z % 2 != 0)
        fail("LE10 with {} layers of cells, expected an even number: it is held at mid-thickness",
             n_z);
    TetMesh mesh =
        mapped_cube({n_r, n_theta, n_z}, {"inner", "outer", "y0", "x0", "bottom", "top"},
                    [](const Vector3& xi) {
                        const Eigen::Vector2d d = direction(xi[1]);
                        return Vector3(between(2, 3.25, xi[0]) * d.x(),
                                       between(1, 2.75, xi[0]) * d.y(), between(-0.3, 0.3, xi[2]));
                    });
    auto& middle = mesh.node_sets["outer_middle"];
    for (const std::int32_t n : mesh.node_sets["outer"])
        if (std::abs(mesh.nodes[n].z()) < 1e-12) middle.push_back(n);
    return mesh;
}

}  // namespace livetet::verification
