#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Points placed in a tet mesh: point i is sum_k weights[i][k] * nodes[tets[i]][k]. Weights sum to one.
struct BarycentricMap {
    std::vector<std::array<std::int32_t, 4>> nodes;
    std::vector<std::array<double, 4>> weights;
    std::vector<double> distance;  ///< metres from the mesh, 0 inside

    std::size_t size() const { return nodes.size(); }
};

/// Places `points` (metres) in `mesh`. A point inside gets the weights of its tet; a point outside gets those of the
/// nearest point on the mesh's boundary extrapolated by nothing: the weights of that nearest boundary point, all in
/// [0, 1], so that no interpolation can overshoot.
BarycentricMap map_into(const TetMesh& mesh, std::span<const Vector3> points);

/// One point's value: sum_k weights[k] * values[nodes[k]], with `values` a span of nodal vectors.
Vector3 interpolate(const BarycentricMap& map, std::size_t point, std::span<const Vector3> values);

}  // namespace livetet
