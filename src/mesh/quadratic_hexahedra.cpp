#include "mesh/quadratic_hexahedra.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "base/error.hpp"
#include "base/sort_and_unique.hpp"

namespace livetet {

namespace {

using Place = std::array<int, 3>;  ///< in halves of a cell, 0 to 2

Place place_of(int node) { return {node % 3, node / 3 % 3, node / 9}; }

/// The corners, as numbers in the cell, of the edge or face that a node is in the middle of.
std::vector<int> corners_around(int node) {
    std::vector<int> corners;
    const Place at = place_of(node);
    for (int c = 0; c < 8; ++c) {
        const Place corner = place_of(quadratic_corner(c));
        bool is_around = true;
        for (int d = 0; d < 3; ++d) is_around = is_around && (at[d] == 1 || at[d] == corner[d]);
        if (is_around) corners.push_back(quadratic_corner(c));
    }
    return corners;
}

/// Number of coordinates in which a node is in the middle: 0 at corners, 3 at the cell's middle.
int middle_order(int node) {
    const Place at = place_of(node);
    return static_cast<int>(std::count(at.begin(), at.end(), 1));
}

/// The middles of the edges between some corners.
std::vector<int> edges_among(const std::vector<int>& corners) {
    std::vector<int> edges;
    for (int node = 0; node < 27; ++node) {
        if (middle_order(node) != 1) continue;
        const auto ends = corners_around(node);
        if (std::ranges::all_of(
                ends, [&](int c) { return std::ranges::find(corners, c) != corners.end(); }))
            edges.push_back(node);
    }
    return edges;
}

/// A cell's tets by their corners' numbers in it, positively oriented.
std::array<std::array<int, 4>, tets_per_quadratic_hexahedron> make_pattern() {
    std::array<std::array<int, 4>, tets_per_quadratic_hexahedron> pattern{};
    std::size_t count = 0;
    const int middle = quadratic_place(1, 1, 1);
    for (int face = 0; face < 27; ++face) {
        if (middle_order(face) != 2) continue;
        const auto around = corners_around(face);
        for (const int edge : edges_among(around))
            for (const int corner : corners_around(edge)) {
                const auto at = [](int node) {
                    const Place p = place_of(node);
                    return Vector3(p[0], p[1], p[2]);
                };
                std::array<int, 4> tet{middle, face, edge, corner};
                Eigen::Matrix3d sides;
                for (int d = 0; d < 3; ++d) sides.col(d) = at(tet[d + 1]) - at(middle);
                if (sides.determinant() < 0) std::swap(tet[2], tet[3]);
                pattern[count++] = tet;
            }
    }
    return pattern;
}

/// Adds to a set those middles of edges and faces, with numbers from `first` on, all of whose
/// corners it has. Sorts it.
void add_middles(std::vector<std::int32_t>& set, std::span<const QuadraticHexahedron> cells,
                 std::size_t nodes, std::int32_t first) {
    std::vector<std::uint8_t> is_in(nodes, 0);
    for (const std::int32_t n : set) is_in[n] = 1;
    std::vector<std::uint8_t> with_middles = is_in;
    for (int node = 0; node < 27; ++node) {
        if (middle_order(node) != 1 && middle_order(node) != 2) continue;
        const auto corners = corners_around(node);
        for (const QuadraticHexahedron& cell : cells)
            if (cell[node] >= first &&
                std::ranges::all_of(corners, [&](int c) { return is_in[cell[c]]; }))
                with_middles[cell[node]] = 1;
    }
    set.clear();
    for (std::size_t n = 0; n < nodes; ++n)
        if (with_middles[n]) set.push_back(static_cast<std::int32_t>(n));
}

/// The faces of cells that some triangles lie in.
struct Faces {
    std::vector<std::int32_t> nodes;         ///< all nine of each, sorted
    std::vector<std::uint8_t> is_middle_of;  ///< of each node: of such a face
};

/// `triangles`: between corners.
Faces faces_of(std::span<const Triangle> triangles, std::span<const QuadraticHexahedron> cells,
               std::size_t nodes) {
    const auto sorted = [](Triangle t) {
        std::ranges::sort(t);
        return t;
    };
    std::set<Triangle> given;
    for (const Triangle& t : triangles) given.insert(sorted(t));
    Faces faces{{}, std::vector<std::uint8_t>(nodes, 0)};
    for (int face = 0; face < 27; ++face) {
        if (middle_order(face) != 2) continue;
        const auto c = corners_around(face), edges = edges_among(c);
        for (const QuadraticHexahedron& cell : cells)
            for (int left_out = 0; left_out < 4; ++left_out) {
                const auto corner = [&](int i) { return cell[c[(left_out + i) % 4]]; };
                if (!given.contains(sorted({corner(1), corner(2), corner(3)}))) continue;
                faces.is_middle_of[cell[face]] = 1;
                faces.nodes.push_back(cell[face]);
                for (const int i : c) faces.nodes.push_back(cell[i]);
                for (const int i : edges) faces.nodes.push_back(cell[i]);
            }
    }
    sort_and_unique(faces.nodes);
    return faces;
}

/// Replaces the triangle sets, of triangles between corners, by those of the faces that these lie
/// in, as far as they are on the boundary, and the node sets of their names by the nodes of all.
void set_faces(TetMesh& mesh) {
    if (mesh.triangle_sets.empty()) return;
    const std::vector<Triangle> boundary = boundary_triangles(mesh.tets);
    for (auto& [name, triangles] : mesh.triangle_sets) {
        Faces faces = faces_of(triangles, mesh.quadratic_hexahedra, mesh.nodes.size());
        triangles.clear();
        std::ranges::copy_if(boundary, std::back_inserter(triangles), [&](const Triangle& t) {
            return std::ranges::any_of(t, [&](std::int32_t n) { return faces.is_middle_of[n]; });
        });
        mesh.node_sets[name] = std::move(faces.nodes);
    }
    std::erase_if(mesh.triangle_sets, [](const auto& set) { return set.second.empty(); });
}

/// Where each cell's Jacobian is looked at: its nodes, and Gauss's 3 x 3 x 3 points.
std::array<Vector3, 54> checked_places() {
    std::array<Vector3, 54> places;
    const double far = std::sqrt(0.6);
    for (int p = 0; p < 27; ++p) {
        const Place at = place_of(p);
        const Vector3 node(at[0], at[1], at[2]);
        places[p] = node / 2;
        places[27 + p] = Vector3::Constant(0.5) + far / 2 * (node - Vector3::Ones());
    }
    return places;
}

std::string place_text(const Vector3& x) {
    return fmt::format("({:.4g}, {:.4g}, {:.4g}) mm", 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
}

/// Throws Error unless the nodes of a cell are there and finite, and it is neither flat nor bent
/// too far.
void check_cell(const TetMesh& mesh, std::size_t e, const std::string& where) {
    static const auto places = checked_places();
    static const auto slopes = [] {
        std::array<Eigen::Matrix<double, 3, 27>, 54> all;
        for (std::size_t i = 0; i < all.size(); ++i) all[i] = quadratic_slopes(places[i]);
        return all;
    }();
    const auto last = std::ssize(mesh.nodes) - 1;
    const QuadraticHexahedron& cell = mesh.quadratic_hexahedra[e];
    Eigen::Matrix<double, 3, 27> x;
    for (int i = 0; i < 27; ++i) {
        if (cell[i] < 0 || cell[i] > last)
            fail("{}: hexahedron {} names node {}, expected 0 to {}", where, e, cell[i], last);
        x.col(i) = mesh.nodes[cell[i]];
        if (!mesh.nodes[cell[i]].allFinite())
            fail("{}: node {} has a coordinate that is not finite", where, cell[i]);
    }
    for (std::size_t i = 0; i < slopes.size(); ++i) {
        const Eigen::Matrix3d J = x * slopes[i].transpose();
        if (!(J.determinant() > 1e-9 * J.colwise().norm().prod()))
            fail(
                "{}: hexahedron {} is flat or turned over at {} (Jacobian {:.3g} mm^3), expected a "
                "positive one at its nodes and quadrature points",
                where, e, place_text(x * quadratic_shape(places[i])), 1e9 * J.determinant());
    }
    for (const Tet& t : tets_of_quadratic(std::span(&cell, 1)))
        if (!(signed_volume(mesh, t) > 0))
            fail(
                "{}: hexahedron {} at {} is bent too far: of the 48 tetrahedra between its nodes "
                "one is turned over",
                where, e, place_text(x.rowwise().mean()));
}

/// Throws Error if two cells have the same corners, or three a face.
void check_faces(const TetMesh& mesh, const std::string& where) {
    std::set<Hexahedron> all;
    std::map<std::array<std::int32_t, 4>, int> cells_at;
    for (std::size_t e = 0; e < mesh.quadratic_hexahedra.size(); ++e) {
        const QuadraticHexahedron& cell = mesh.quadratic_hexahedra[e];
        Hexahedron corners{};
        for (int c = 0; c < 8; ++c) corners[c] = cell[quadratic_corner(c)];
        std::ranges::sort(corners);
        if (!all.insert(corners).second)
            fail("{}: hexahedron {} has the corners of another, expected each place once", where,
                 e);
        for (int face = 0; face < 27; ++face) {
            if (middle_order(face) != 2) continue;
            const auto around = corners_around(face);
            std::array<std::int32_t, 4> key{};
            for (std::size_t c = 0; c < 4; ++c) key[c] = cell[around[c]];
            std::ranges::sort(key);
            if (++cells_at[key] > 2)
                fail("{}: a face of hexahedron {} is that of two others, too, expected one at most",
                     where, e);
        }
    }
}

}  // namespace

std::vector<Tet> tets_of_quadratic(std::span<const QuadraticHexahedron> cells) {
    static const auto pattern = make_pattern();
    std::vector<Tet> tets;
    tets.reserve(pattern.size() * cells.size());
    for (const QuadraticHexahedron& cell : cells)
        for (const auto& [a, b, c, d] : pattern)
            tets.push_back({cell[a], cell[b], cell[c], cell[d]});
    return tets;
}

void add_middle_nodes(std::vector<Vector3>& nodes, std::span<QuadraticHexahedron> cells) {
    std::map<std::array<std::int32_t, 4>, std::int32_t> middles;  // by corners, the lowest first
    const auto key_of = [](const QuadraticHexahedron& cell, const std::vector<int>& corners) {
        std::array<std::int32_t, 4> key{-1, -1, -1, -1};
        for (std::size_t c = 0; c < corners.size(); ++c) key[c] = cell[corners[c]];
        std::ranges::sort(key);
        return key;
    };
    for (int node = 0; node < 27; ++node) {  // those that other cells were given
        if (middle_order(node) != 1 && middle_order(node) != 2) continue;
        for (const QuadraticHexahedron& cell : cells)
            if (cell[node] >= 0)
                middles.try_emplace(key_of(cell, corners_around(node)), cell[node]);
    }
    for (int order = 1; order <= 3; ++order)
        for (int node = 0; node < 27; ++node) {
            if (middle_order(node) != order) continue;
            const auto corners = corners_around(node), edges = edges_among(corners);
            // Of the shape functions of 20 nodes at the middle of a face or of the cell.
            const double of_corner = order == 1 ? 0.5 : -0.25, of_edge = order == 2 ? 0.5 : 0.25;
            for (QuadraticHexahedron& cell : cells) {
                if (cell[node] >= 0) continue;
                const auto fresh = static_cast<std::int32_t>(nodes.size());
                cell[node] = order == 3
                                 ? fresh
                                 : middles.try_emplace(key_of(cell, corners), fresh).first->second;
                if (cell[node] != fresh) continue;
                Vector3 x = Vector3::Zero();
                for (const int c : corners) x += of_corner * nodes[cell[c]];
                for (const int k : edges)
                    if (order > 1) x += of_edge * nodes[cell[k]];
                nodes.push_back(x);
            }
        }
}

TetMesh quadratic_hexahedra(TetMesh mesh, std::vector<QuadraticHexahedron> cells,
                            std::span<const std::int32_t> regions, const std::string& where) {
    if (cells.empty()) fail("{}: has no hexahedra, expected at least one", where);
    const auto first_made = static_cast<std::int32_t>(mesh.nodes.size());
    add_middle_nodes(mesh.nodes, cells);
    mesh.quadratic_hexahedra = std::move(cells);
    check_quadratic_mesh(mesh, where);
    mesh.tets = tets_of_quadratic(mesh.quadratic_hexahedra);
    for (const std::int32_t region : regions)
        mesh.regions.insert(mesh.regions.end(), tets_per_quadratic_hexahedron, region);
    for (auto& [name, set] : mesh.node_sets)
        add_middles(set, mesh.quadratic_hexahedra, mesh.nodes.size(), first_made);
    set_faces(mesh);
    return mesh;
}

TetMesh quadratic_grid(const TetMesh& grid) {
    std::vector<QuadraticHexahedron> cells(grid.hexahedra.size());
    std::vector<std::int32_t> regions;
    for (std::size_t e = 0; e < cells.size(); ++e) {
        cells[e].fill(-1);
        for (int c = 0; c < 8; ++c) cells[e][quadratic_corner(c)] = grid.hexahedra[e][c];
        if (!grid.regions.empty()) regions.push_back(grid.regions[tets_per_hexahedron * e]);
    }
    TetMesh mesh;
    mesh.nodes = grid.nodes;
    mesh.node_sets = grid.node_sets;
    mesh.triangle_sets = grid.triangle_sets;
    mesh.shares = grid.shares;
    return quadratic_hexahedra(std::move(mesh), std::move(cells), regions, "the grid");
}

void check_quadratic_mesh(const TetMesh& mesh, const std::string& where) {
    for (std::size_t e = 0; e < mesh.quadratic_hexahedra.size(); ++e) check_cell(mesh, e, where);
    check_faces(mesh, where);
    if (!mesh.shares.empty() && mesh.shares.size() != mesh.quadratic_hexahedra.size())
        fail("{}: {} shares for {} hexahedra, expected one each", where, mesh.shares.size(),
             mesh.quadratic_hexahedra.size());
    for (const double share : mesh.shares)
        if (!(share > 0 && share <= 1))
            fail("{}: a hexahedron's share is {}, expected above 0 to 1", where, share);
}

Eigen::Matrix<double, 27, 1> quadratic_shape(const Vector3& x) {
    const QuadraticPolynomials a(x[0]), b(x[1]), c(x[2]);
    Eigen::Matrix<double, 27, 1> values;
    for (int node = 0; node < 27; ++node) {
        const auto [i, j, k] = place_of(node);
        values[node] = a.value[i] * b.value[j] * c.value[k];
    }
    return values;
}

Eigen::Matrix<double, 3, 27> quadratic_slopes(const Vector3& x) {
    const QuadraticPolynomials a(x[0]), b(x[1]), c(x[2]);
    Eigen::Matrix<double, 3, 27> slopes;
    for (int node = 0; node < 27; ++node) {
        const auto [i, j, k] = place_of(node);
        slopes.col(node) << a.slope[i] * b.value[j] * c.value[k],
            a.value[i] * b.slope[j] * c.value[k], a.value[i] * b.value[j] * c.slope[k];
    }
    return slopes;
}

}  // namespace livetet
