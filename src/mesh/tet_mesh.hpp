#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

using Tet = std::array<std::int32_t, 4>;

/// The edges of a tet, in the order of VTK, XDMF and CalculiX: edge k joins corners tet_edges[k][0]
/// and [1].
inline constexpr int tet_edges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

/// A hexahedron's nodes: corner c is at the offset (c & 1, c >> 1 & 1, c >> 2 & 1) along its axes.
using Hexahedron = std::array<std::int32_t, 8>;
/// Tets that a hexahedron is divided into where a mesh of tets is expected.
inline constexpr std::size_t tets_per_hexahedron = 6;

/// The 27 nodes of a hexahedron of order 2 (Q2): node i + 3 j + 9 k is at (i, j, k) / 2 of the
/// cell's own coordinates from 0 to 1. Its corners, edges and faces may be anywhere.
using QuadraticHexahedron = std::array<std::int32_t, 27>;
/// Tets that a quadratic hexahedron is divided into; its 27 nodes are their corners.
inline constexpr std::size_t tets_per_quadratic_hexahedron = 48;

/// A body at rest: tets of four nodes (P1) or ten (P2, see `quadratic_mesh`), a grid's hexahedra
/// (see `hex_grid.hpp`), or quadratic hexahedra (see `quadratic_hexahedra.hpp`). Positions in
/// metres, RAS. Tets are positively oriented: det(x1 - x0, x2 - x0, x3 - x0) > 0. Plain data;
/// `check_tet_mesh` checks its consistency.
struct TetMesh {
    std::vector<Vector3> nodes;
    std::vector<Tet> tets;
    /// P2 only: the midpoint node of each edge, in the order of `tet_edges`.
    std::vector<std::array<std::int32_t, 6>> edge_nodes;
    std::vector<std::int32_t> regions;  ///< material label of each tet; empty: one material
    /// Named node sets, sorted: masks, physical groups.
    std::map<std::string, std::vector<std::int32_t>> node_sets;
    /// Named surface pieces: physical groups.
    std::map<std::string, std::vector<Triangle>> triangle_sets;
    /// Grids only: the cells, and what of each is inside the body, above 0 to 1. The tets are then
    /// six of each cell, in order (`tets_of_hexahedra`), for whatever takes tets.
    std::vector<Hexahedron> hexahedra{};
    std::vector<double> shares{};
    /// Quadratic hexahedra only: the cells; `shares` as of a grid, or empty: all of each. The tets
    /// are 48 of each cell, in order (`tets_of_quadratic`).
    std::vector<QuadraticHexahedron> quadratic_hexahedra{};

    /// Whether its elements are hexahedra, of either order.
    bool has_hexahedra() const { return !hexahedra.empty() || !quadratic_hexahedra.empty(); }
    /// Tets that an element is divided into: 1, if it is a tet.
    std::size_t tets_per_element() const {
        return !quadratic_hexahedra.empty() ? tets_per_quadratic_hexahedron
               : !hexahedra.empty()         ? tets_per_hexahedron
                                            : 1;
    }
};

/// Number of corner nodes: all nodes of a P1 mesh, the first ones of a P2 mesh that no cut has
/// opened (see with_opened_quadratic).
inline std::int32_t corner_count(const TetMesh& mesh) {
    std::int32_t first = static_cast<std::int32_t>(mesh.nodes.size());
    for (const auto& edges : mesh.edge_nodes)
        for (const std::int32_t n : edges) first = std::min(first, n);
    return first;
}

/// Signed volume of tet `t`, m^3; positive for a positively oriented tet.
double signed_volume(const TetMesh& mesh, const Tet& t);
double signed_volume(std::span<const Vector3> nodes, const Tet& t);

/// Volume of the mesh, m^3.
double volume(const TetMesh& mesh);

/// The triangles that belong to exactly one tet, wound outwards, in the order of the tets. O(n) in
/// the number of tets, with 17 bytes of memory for each. Throws Error beyond 2^30 tets.
std::vector<Triangle> boundary_triangles(std::span<const Tet> tets);

/// The nodes of a set of triangles, sorted, without duplicates.
std::vector<std::int32_t> nodes_of(std::span<const Triangle> triangles);

/// The mesh's node set of that name. Throws Error, naming the sets that there are, if it has none.
const std::vector<std::int32_t>& node_set(const TetMesh& mesh, std::string_view name);

/// Removes unused nodes, except the first `kept`, and renumbers the tets. For P1 meshes without
/// sets.
void drop_unused_nodes(TetMesh& mesh, std::size_t kept = 0);

/// Throws Error, naming `where`, if the mesh has no tets, an index out of range, a node that is not
/// finite or is unused, or a tet with a volume that is not positive (giving its number and position
/// in mm).
void check_tet_mesh(const TetMesh& mesh, const std::string& where);

/// Numbers of nodes and tets.
struct MeshSize {
    std::size_t nodes = 0, tets = 0;
};

/// Two parts of that check, for meshes that ranks share. Of some consecutive rows of a mesh of
/// `size`, those from number `first` on: indices and coordinates.
void check_rows(const TetMesh& rows, const MeshSize& size, const MeshSize& first,
                const std::string& where);
/// Of tets with the numbers `numbers`; empty: 0, 1 and so on: volumes.
void check_volumes(std::span<const Vector3> nodes, std::span<const Tet> tets,
                   std::span<const std::int32_t> numbers, const std::string& where);

}  // namespace livetet
