#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

using Tet = std::array<std::int32_t, 4>;

/// The edges of a tet, in the order of VTK, XDMF and CalculiX: edge k joins corners tet_edges[k][0]
/// and [1].
inline constexpr int tet_edges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

/// A mesh of tetrahedra in its rest shape, of four nodes each (P1) or of ten (P2, see
/// `quadratic_mesh`). Positions in metres, RAS. Each tet is positively oriented: det(x1 - x0, x2 -
/// x0, x3 - x0) > 0. Plain data: `check_tet_mesh` says whether it holds together.
struct TetMesh {
    std::vector<Vector3> nodes;
    std::vector<Tet> tets;
    std::vector<std::array<std::int32_t, 6>>
        edge_nodes;                     ///< P2: the node in the middle of each of `tet_edges`
    std::vector<std::int32_t> regions;  ///< material label of each tet; empty: all one body
    std::map<std::string, std::vector<std::int32_t>>
        node_sets;  ///< named nodes, sorted: masks, physical groups
    std::map<std::string, std::vector<Triangle>>
        triangle_sets;  ///< named pieces of surface: physical groups
};

/// How many nodes are corners of tets: all of a P1 mesh, the first ones of a P2 mesh.
inline std::int32_t corner_count(const TetMesh& mesh) {
    std::int32_t first = static_cast<std::int32_t>(mesh.nodes.size());
    for (const auto& edges : mesh.edge_nodes)
        for (const std::int32_t n : edges) first = std::min(first, n);
    return first;
}

/// The signed volume of tet `t`, in m^3.
double signed_volume(const TetMesh& mesh, const Tet& t);

/// Volume of the whole mesh, in m^3.
double volume(const TetMesh& mesh);

/// The triangles that belong to one tet only, wound outwards, in the order of the tets. O(tets).
std::vector<Triangle> boundary_triangles(std::span<const Tet> tets);

/// The nodes of a set of triangles, sorted, each once.
std::vector<std::int32_t> nodes_of(std::span<const Triangle> triangles);

/// Drops the nodes that no tet uses, but none of the first `kept`, and renumbers the tets of a P1
/// mesh without sets.
void drop_unused_nodes(TetMesh& mesh, std::size_t kept = 0);

/// Throws Error, naming `where`, if the mesh has no tets, an index out of range, a node that is not
/// finite or belongs to no tet, or a tet of negative or no volume (which one, at which place in
/// mm).
void check_tet_mesh(const TetMesh& mesh, const std::string& where);

}  // namespace livetet
