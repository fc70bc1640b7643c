#pragma once

#include <unordered_map>

#include "mesh/barycentric_map.hpp"
#include "mesh/hierarchy.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The same body with ten-node tets (P2): midpoints of the straight edges follow the corner nodes,
/// as edges_by_lower_end has them. A node set receives the midpoints of its edges: those of the
/// triangle set of its name if there is one, else of all edges whose two ends are in the set.
TetMesh quadratic_mesh(const TetMesh& linear);

/// Places the nodes of a quadratic mesh in the linear mesh of the same tets: a corner at itself, a
/// midpoint halfway between two corners.
BarycentricMap map_into_linear(const TetMesh& quadratic, const TetMesh& linear);

/// Adds the quadratic form of the finest level as a new finest level. The P1 mesh becomes the next
/// level.
MeshHierarchy with_quadratic_level(MeshHierarchy hierarchy);

/// Looks up the midpoint nodes of a P2 mesh by the two corners of their edge.
class EdgeNodes {
  public:
    explicit EdgeNodes(const TetMesh& mesh);
    /// Only those on the edges of some triangles, which are faces of the mesh.
    EdgeNodes(const TetMesh& mesh, std::span<const Triangle> triangles);
    /// The midpoint node of the edge a-b; -1 if there is none.
    std::int32_t between(std::int32_t a, std::int32_t b) const;
    bool empty() const { return middles_.empty(); }

  private:
    std::unordered_map<std::uint64_t, std::int32_t> middles_;
};

/// Value at one point of a P1 or P2 mesh, given its barycentric coordinates L in a tet. On ten
/// nodes:
///
///     v = sum_i L_i (2 L_i - 1) v_i + sum_{i<j} 4 L_i L_j v_ij
Vector3 interpolate(const BarycentricMap& map, const EdgeNodes& edges, std::size_t point,
                    std::span<const Vector3> values);

/// Evaluates nodal vector fields of a P1 or P2 mesh at points fixed in the body.
class PointSampler {
  public:
    PointSampler(const TetMesh& mesh, std::span<const Vector3> points,
                 Outside outside = Outside::nearest)
        : map_(map_into(mesh, points, outside)), edges_(mesh) {}
    /// That of the same places once a cut has opened: each in its tet, which keeps its number and
    /// may have other nodes. `before`: the mesh that this was made of.
    PointSampler after_cut(const TetMesh& before, const TetMesh& after) const;
    std::vector<Vector3> sample(std::span<const Vector3> values) const;
    /// The value at one point.
    Vector3 sample(std::size_t point, std::span<const Vector3> values) const {
        return interpolate(map_, edges_, point, values);
    }
    /// Distance of each point from the mesh, m. Points outside take the value of the nearest
    /// surface point unless extrapolation is asked for.
    const std::vector<double>& distances() const { return map_.distance; }

  private:
    BarycentricMap map_;
    EdgeNodes edges_;
};

/// All surface nodes, edge midpoints included, sorted.
std::vector<std::int32_t> surface_nodes(const TetMesh& mesh);

/// Those of `nodes` that are on the surface, edge midpoints included, sorted. Looks at no more than
/// the tets at these nodes.
std::vector<std::int32_t> surface_nodes_among(const TetMesh& mesh,
                                              std::span<const std::int32_t> nodes);

/// `nodes` and, in a P2 mesh, the midpoints of surface edges between two of them, sorted.
std::vector<std::int32_t> with_edge_nodes_between(const TetMesh& mesh,
                                                  std::vector<std::int32_t> nodes);

/// The three nodes that each take a third of the resultant of a uniform traction on a triangle: its
/// corners on P1, its edge midpoints on P2, where the integral of a corner's shape function is
/// zero.
std::array<std::int32_t, 3> traction_nodes(const Triangle& triangle, const EdgeNodes& edges);

}  // namespace livetet
