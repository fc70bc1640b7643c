#pragma once

#include <Eigen/Core>

#include <string>
#include <vector>

namespace livetet {

/// A named point: a fiducial, a landmark, a target. Metres; RAS where it belongs to an image.
struct NamedPoint {
    std::string name;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

}  // namespace livetet
