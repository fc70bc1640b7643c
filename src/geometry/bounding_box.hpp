#pragma once

#include <Eigen/Geometry>

#include <span>

namespace livetet {

/// The box along the axes around points, m; empty without any.
inline Eigen::AlignedBox3d box_of(std::span<const Eigen::Vector3d> points) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& x : points) box.extend(x);
    return box;
}

}  // namespace livetet
