#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>

#include "geometry/transform.hpp"

namespace livetet {

/// Acceptance limits of a spin calibration.
struct SpinOptions {
    std::size_t min_poses = 10;
    double min_turn_deg = 90;  ///< arc around the shaft that the poses must cover
    double max_tilt_deg =
        5;  ///< limit of the shaft's RMS tilt; beyond it the tool did not turn about its shaft
};

/// Result of a spin calibration, with its quality.
struct SpinCalibration {
    /// Unit vector along the axis of rotation.
    Eigen::Vector3d shaft_in_tool = Eigen::Vector3d::Zero();
    /// The same in the tracker's frame, averaged over the poses.
    Eigen::Vector3d shaft_in_tracker = Eigen::Vector3d::Zero();
    double tilt_deg = 0;  ///< RMS angle between R_i shaft_in_tool and shaft_in_tracker
    double turn_deg = 0;  ///< arc covered by the poses: 360 degrees less the largest gap
    std::size_t used = 0;
};

/// Spin calibration: finds a tool's shaft from poses of the tool turning about it. The unit vectors
/// a (tool) and b (tracker) with R_i a = b for all poses (R_i, t_i) = tracker_from_tool[i] minimise
///
///     sum_i |R_i a - b|^2 = 2 n (1 - b^T M a)
///
/// so they are the first singular vectors of the mean rotation M. The poses leave the sign of a
/// open: a points towards `tip` (tool frame, metres) if that is given, else its largest component
/// is positive. Throws Error if there are too few poses, if a value is not finite, or if the poses
/// turn too little about the shaft or about more than one axis.
SpinCalibration calibrate_spin(std::span<const RigidTransform<Tracker, Tool>> tracker_from_tool,
                               const std::optional<Eigen::Vector3d>& tip = {},
                               const SpinOptions& options = {});

/// Tip frame with axes along the shaft, by the convention of PLUS and SlicerIGT: the tip's Z axis
/// points away from the sensor, so the shaft lies along -Z. Its X axis is the projection of the
/// tool's X axis, or of its Y axis if the shaft is within 20 degrees of X. `tip_in_tool` in metres.
RigidTransform<Tool, Tip> along_shaft(const Eigen::Vector3d& tip_in_tool,
                                      const Eigen::Vector3d& shaft_in_tool);

}  // namespace livetet
