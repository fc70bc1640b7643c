#pragma once

#include <cstdint>
#include <numeric>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Nodes that a selection may take.
enum class NodeScope { all, surface_only };

/// The nodes of `scope`, sorted, whose position (metres) satisfies the predicate.
template <class Predicate>
std::vector<std::int32_t> select_nodes(const TetMesh& mesh, NodeScope scope,
                                       const Predicate& inside) {
    std::vector<std::int32_t> candidates;
    if (scope == NodeScope::surface_only) {
        candidates = nodes_of(boundary_triangles(mesh.tets));
    } else {
        candidates.resize(mesh.nodes.size());
        std::iota(candidates.begin(), candidates.end(), 0);
    }
    std::erase_if(candidates, [&](std::int32_t n) { return !inside(mesh.nodes[n]); });
    return candidates;
}

/// The nodes in the closed box from `low` to `high` (metres, RAS), sorted. Throws Error if low >
/// high along an axis.
std::vector<std::int32_t> nodes_in_box(const TetMesh& mesh, const Vector3& low, const Vector3& high,
                                       NodeScope scope = NodeScope::all);

/// The nodes within `radius` (metres) of `centre`, sorted. Throws Error if the radius is negative.
std::vector<std::int32_t> nodes_in_sphere(const TetMesh& mesh, const Vector3& centre, double radius,
                                          NodeScope scope = NodeScope::all);

/// The nodes x with (x - point) . normal <= 0: the side that the normal points away from, its plane
/// included, sorted. Throws Error if the normal is zero.
std::vector<std::int32_t> nodes_in_half_space(const TetMesh& mesh, const Vector3& point,
                                              const Vector3& normal,
                                              NodeScope scope = NodeScope::all);

}  // namespace livetet
