#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Points placed in a tet mesh: point i is sum_k weights[i][k] * nodes[tets[i]][k]. Weights sum to
/// one.
struct BarycentricMap {
    std::vector<std::array<std::int32_t, 4>> nodes;
    std::vector<std::array<double, 4>> weights;
    std::vector<double> distance;  ///< metres from the mesh, 0 inside

    std::size_t size() const { return nodes.size(); }
    /// Weight k of point i in a mean, which has no use for negative ones.
    double mean_weight(std::size_t i, int k) const { return std::max(weights[i][k], 0.0); }
};

/// What a point outside of a mesh takes. `nearest`: the weights of the nearest point on the
/// boundary, all in [0, 1], so that no interpolation can overshoot. `extrapolated`: those of the
/// tet behind that point, which keep linear fields and so rigid motions, as far out as no weight is
/// below min_extrapolated_weight; from there on they stay.
enum class Outside { nearest, extrapolated };
constexpr double min_extrapolated_weight = -1;

/// Places `points` (metres) in `mesh`. A point inside gets the weights of its tet.
BarycentricMap map_into(const TetMesh& mesh, std::span<const Vector3> points,
                        Outside outside = Outside::nearest);

/// One point's value: sum_k weights[k] * values[nodes[k]], with `values` a span of nodal vectors.
Vector3 interpolate(const BarycentricMap& map, std::size_t point, std::span<const Vector3> values);

}  // namespace livetet
