#pragma once

#include <Eigen/Core>

#include <span>
#include <string>
#include <vector>

namespace livetet {

/// A named point: a fiducial, a landmark or a target. Metres; RAS if it belongs to an image.
struct NamedPoint {
    std::string name;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

/// The positions, without the names.
inline std::vector<Eigen::Vector3d> positions_of(std::span<const NamedPoint> points) {
    std::vector<Eigen::Vector3d> positions;
    for (const NamedPoint& p : points) positions.push_back(p.position);
    return positions;
}

}  // namespace livetet
