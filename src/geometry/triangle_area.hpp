#pragma once

#include <Eigen/Geometry>

#include <span>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// Normal of a triangle, its length the area: m^2.
inline Vector3 area_vector(std::span<const Vector3> nodes, const Triangle& t) {
    return (nodes[t[1]] - nodes[t[0]]).cross(nodes[t[2]] - nodes[t[0]]) / 2;
}

}  // namespace livetet
