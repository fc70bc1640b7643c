#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace livetet {

using Vector3 = Eigen::Vector3d;
using Triangle = std::array<std::int32_t, 3>;
using Tet = std::array<std::int32_t, 4>;

/// A surface of triangles, wound so that normals point outwards. Positions in metres.
struct TriangleMesh {
    std::vector<Vector3> nodes;
    std::vector<Triangle> triangles;
};

/// A mesh of four-node tetrahedra in its rest shape. Positions in metres, RAS. Each tet is positively oriented:
/// det(x1 - x0, x2 - x0, x3 - x0) > 0. Plain data: `check_tet_mesh` says whether it holds together.
struct TetMesh {
    std::vector<Vector3> nodes;
    std::vector<Tet> tets;
    std::vector<std::int32_t> regions;                           ///< material label of each tet; empty: all one body
    std::map<std::string, std::vector<std::int32_t>> node_sets;  ///< named nodes, sorted: masks, physical groups
    std::map<std::string, std::vector<Triangle>> triangle_sets;  ///< named pieces of surface: physical groups
};

/// The signed volume of tet `t`, in m^3.
double signed_volume(const TetMesh& mesh, const Tet& t);

/// Volume of the whole mesh, in m^3.
double volume(const TetMesh& mesh);

/// The triangles that belong to one tet only, wound outwards, in the order of the tets. O(tets).
std::vector<Triangle> boundary_triangles(std::span<const Tet> tets);

/// The nodes of a set of triangles, sorted, each once.
std::vector<std::int32_t> nodes_of(std::span<const Triangle> triangles);

/// Throws Error, naming `where`, if the mesh has no tets, an index out of range, a node that is not finite or belongs
/// to no tet, or a tet of negative or no volume (which one, at which place in mm).
void check_tet_mesh(const TetMesh& mesh, const std::string& where);

}  // namespace livetet
