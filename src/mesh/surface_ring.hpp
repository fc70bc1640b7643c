#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/surface_patch.hpp"

namespace livetet {

/// Nodes of a surface around a patch, which tell how the tissue about it moves.
struct SurfaceRing {
    std::vector<std::int32_t> nodes;   ///< sorted; empty if there are too few of them
    std::vector<double> weights;       ///< one a node; their sum is 1
    Vector3 middle = Vector3::Zero();  ///< mean place of the patch's nodes, m

    /// Value of a nodal field at the patch's middle, interpolated from the ring.
    Vector3 interpolate(std::span<const Vector3> values) const;
};

/// The ring about a patch of `around` with the given radius (m): the nodes outside it, between 1.3
/// and 2.5 radii from its point `at` along the surface, or up to as many radii, at most 8, as take
/// in six nodes. The weights
///
///     w_i = (1 - c . M^-1 (y_i - c)) / N,     c = mean of y,     M = mean of (y - c) (y - c)^T,
///
/// with y_i the place of node i from the middle in the tangent plane, are exact for fields that are
/// linear in that plane. Where one would be negative, as the ring lies to one side, all are 1/N.
SurfaceRing surface_ring(const SurfaceNeighbourhood& around, const SurfacePatch& patch,
                         double radius);

}  // namespace livetet
