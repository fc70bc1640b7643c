#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Interpolation weights of points in a tet mesh: point i is sum_k weights[i][k] * nodes[i][k],
/// where nodes[i] are the corners of the tet it lies in. Weights sum to one.
struct BarycentricMap {
    std::vector<std::array<std::int32_t, 4>> nodes;
    std::vector<std::array<double, 4>> weights;
    std::vector<double> distance;  ///< distance from the mesh, metres; 0 inside

    std::size_t size() const { return nodes.size(); }
    /// Weight k of point i for weighted means, which need weights that are not negative.
    double mean_weight(std::size_t i, int k) const { return std::max(weights[i][k], 0.0); }
};

/// Weights of a point outside the mesh.
/// - `nearest`: the weights of the nearest boundary point, all in [0, 1], so interpolated values
///   never overshoot.
/// - `extrapolated`: the barycentric weights in the tet behind that boundary point. They reproduce
///   linear fields, so also rigid motions. Along the line from the boundary point they are used as
///   far as no weight is below min_extrapolated_weight, and are constant beyond.
enum class Outside { nearest, extrapolated };
constexpr double min_extrapolated_weight = -1;

/// Computes the weights of `points` (metres) in `mesh`. Throws Error if the mesh has no tets or a
/// point is not finite.
BarycentricMap map_into(const TetMesh& mesh, std::span<const Vector3> points,
                        Outside outside = Outside::nearest);

/// Barycentric weights of `x` (metres) in a tet of the mesh, wherever it lies; they sum to one.
std::array<double, 4> weights_in(const TetMesh& mesh, const Tet& t, const Vector3& x);

/// Value at one point: sum_k weights[k] * values[nodes[k]]; `values` has one vector a node.
Vector3 interpolate(const BarycentricMap& map, std::size_t point, std::span<const Vector3> values);

}  // namespace livetet
