#pragma once

#include <cstdint>
#include <map>
#include <span>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// A place on a surface, m, and the triangle in which it lies.
struct SurfacePoint {
    std::size_t triangle = 0;
    Vector3 place = Vector3::Zero();
};

/// Nodes of a surface within `radius` (metres) of the point `from`, with their distances along the
/// surface: lengths of shortest paths through the triangles. Paths cross edges at six points each
/// (M. Lanthier, A. Maheshwari, J.-R. Sack, Approximating weighted shortest paths on polyhedral
/// surfaces, 1997), so that a distance is never too small, and too large by less than 1 % for
/// triangles without very small angles.
std::map<std::int32_t, double> distances_on_surface(std::span<const Vector3> nodes,
                                                    std::span<const Triangle> triangles,
                                                    const SurfacePoint& from, double radius);

}  // namespace livetet
