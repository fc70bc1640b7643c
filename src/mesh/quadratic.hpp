#pragma once

#include <unordered_map>

#include "mesh/barycentric_map.hpp"
#include "mesh/hierarchy.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The same body with ten-node tetrahedra: a node more in the middle of each edge, behind the
/// corners. Edges stay straight. Node sets take in the middles of edges of their own triangles,
/// where a triangle set of the same name says which, else of all edges between two of their nodes.
TetMesh quadratic_mesh(const TetMesh& linear);

/// The nodes of a quadratic mesh in the linear mesh that it was made from: itself a corner, halfway
/// between two a middle.
BarycentricMap map_into_linear(const TetMesh& quadratic);

/// `hierarchy` with its finest level in quadratic form in front: the P1 mesh becomes the next
/// level.
MeshHierarchy with_quadratic_level(MeshHierarchy hierarchy);

/// The middle nodes of a P2 mesh by the two corners of their edge.
class EdgeNodes {
  public:
    explicit EdgeNodes(const TetMesh& mesh);
    /// The node in the middle of the edge a-b, -1 where there is none.
    std::int32_t between(std::int32_t a, std::int32_t b) const;
    bool empty() const { return middles_.empty(); }

  private:
    std::unordered_map<std::uint64_t, std::int32_t> middles_;
};

/// One point's value in a P1 or P2 mesh from its place among the corners of a tet:
/// sum_i L_i (2 L_i - 1) v_i + sum_ij 4 L_i L_j v_ij on ten nodes.
Vector3 interpolate(const BarycentricMap& map, const EdgeNodes& edges, std::size_t point,
                    std::span<const Vector3> values);

/// Reads nodal vectors of a P1 or P2 mesh off at points that stay where they are in the body.
class PointSampler {
  public:
    PointSampler(const TetMesh& mesh, std::span<const Vector3> points,
                 Outside outside = Outside::nearest)
        : map_(map_into(mesh, points, outside)), edges_(mesh) {}
    std::vector<Vector3> sample(std::span<const Vector3> values) const;
    /// How far the point lies outside the mesh, m; its nearest surface point stands for it.
    double distance(std::size_t point) const { return map_.distance[point]; }

  private:
    BarycentricMap map_;
    EdgeNodes edges_;
};

/// All nodes of the surface, those of its edges too, sorted.
std::vector<std::int32_t> surface_nodes(const TetMesh& mesh);

/// `nodes` of the surface, and in a P2 mesh the middles of surface edges between two of them,
/// sorted.
std::vector<std::int32_t> with_edge_nodes_between(const TetMesh& mesh,
                                                  std::vector<std::int32_t> nodes);

/// The three nodes that share the resultant of a uniform traction on a triangle evenly: its corners
/// on P1, the middles of its edges on P2 (there, the integral of a corner's shape function is
/// zero).
std::array<std::int32_t, 3> traction_nodes(const Triangle& triangle, const EdgeNodes& edges);

}  // namespace livetet
