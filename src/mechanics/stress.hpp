#pragma once

#include <Eigen/Core>

#include <cmath>

namespace livetet {

/// Von Mises' equivalent of a stress, in its unit: sqrt(3/2 s:s), s the deviator.
inline double von_mises(const Eigen::Matrix3d& stress) {
    const Eigen::Matrix3d deviator = stress - stress.trace() / 3 * Eigen::Matrix3d::Identity();
    return std::sqrt(1.5 * deviator.squaredNorm());
}

}  // namespace livetet
