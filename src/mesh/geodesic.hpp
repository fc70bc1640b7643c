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
/// surface, never too small on a plane. Shortest paths that cross edges at six points each leave up
/// to 1 % too much (M. Lanthier, A. Maheshwari, J.-R. Sack, 1997); straight lines through unfolded
/// triangles then take off what they can (M. Novotni, R. Klein, 2002): on a plane all but round-off
/// for triangles that are not obtuse, on a curved surface more the smaller the triangles are.
std::map<std::int32_t, double> distances_on_surface(std::span<const Vector3> nodes,
                                                    std::span<const Triangle> triangles,
                                                    const SurfacePoint& from, double radius);

}  // namespace livetet
