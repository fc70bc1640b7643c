#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>

#include "geometry/transform.hpp"

namespace livetet {

struct SpinOptions {
    std::size_t min_poses = 10;
    double min_turn_deg = 90;  ///< the poses must cover this much of the circle round the shaft
    double max_tilt_deg = 5;   ///< RMS; a shaft that tilts more is not the axis of the turn
};

struct SpinCalibration {
    Eigen::Vector3d shaft_in_tool =
        Eigen::Vector3d::Zero();  ///< unit vector along the axis of the turn
    Eigen::Vector3d shaft_in_tracker =
        Eigen::Vector3d::Zero();  ///< the same in the tracker's frame, on average
    double tilt_deg = 0;          ///< RMS angle between R_i shaft_in_tool and shaft_in_tracker
    double turn_deg = 0;  ///< how much of the circle the poses cover: all but the largest gap
    std::size_t used = 0;
};

/// Spin calibration: the tool turns about its own shaft, R_i a = b for every pose
/// `tracker_from_tool[i]`. The unit vectors a, b of least sum_i |R_i a - b|^2 = 2 n (1 - b^T M a)
/// are the first singular vectors of the mean rotation M. Nothing in the poses tells one end of the
/// shaft from the other: it points to the side of `tip` (in the tool's frame, metres) where that is
/// given, else its largest component is positive. Throws Error, saying what was found and expected,
/// for too few poses, values that are not finite, poses that turn too little about the shaft, and
/// poses that turn about more than one axis.
SpinCalibration calibrate_spin(std::span<const RigidTransform<Tracker, Tool>> tracker_from_tool,
                               const std::optional<Eigen::Vector3d>& tip = {},
                               const SpinOptions& options = {});

/// A tip whose axes follow the shaft, as PLUS and SlicerIGT have it: the tip's Z points away from
/// the sensor, so that the shaft lies along -Z, and its X is the tool's X as nearly as can be (its
/// Y where the shaft is within 20 degrees of X).
RigidTransform<Tool, Tip> along_shaft(const Eigen::Vector3d& tip_in_tool,
                                      const Eigen::Vector3d& shaft_in_tool);

}  // namespace livetet
