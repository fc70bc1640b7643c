#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>

#include "geometry/transform.hpp"

namespace livetet {

struct PivotOptions {
    std::optional<double> reject_beyond_sigma =
        3;  ///< farther than median + this many deviations is out; none: keep all
    std::size_t min_poses = 10;
    double min_spread_deg = 15;  ///< the largest turn between two poses must reach this
    double min_singular_ratio =
        0.02;  ///< below this the tool turned about one axis only (0.3 degrees of noise: 0.004)
};

struct PivotCalibration {
    RigidTransform<Tool, Tip> tool_from_tip;                     ///< the tip's offset; no turn
    Eigen::Vector3d pivot_in_tracker = Eigen::Vector3d::Zero();  ///< metres
    double rms =
        0;  ///< RMS distance between R_i tip + t_i and the pivot over the poses used, metres
    std::size_t used = 0;
    std::size_t rejected = 0;
    double spread_deg = 0;  ///< largest turn between two of the poses used
    double condition = 0;   ///< largest to smallest singular value of the system
    int rank =
        0;  ///< singular values above min_singular_ratio times the largest: 6 when all is well
};

/// Pivot calibration: the tool turns about its resting tip, R_i tip + t_i = pivot for every pose
/// `tracker_from_tool[i]`, so [R_i | -I] [tip; pivot] = -t_i in the least-squares sense (Yaniv
/// 2015, "Which pivot calibration?", SPIE 9415, "algebraic one-step"). Poses farther from the pivot
/// than median + `reject_beyond_sigma` robust deviations (1.4826 MAD) are left out and the rest is
/// fitted again, until none is left out. Throws Error, saying what was found and expected, for too
/// few poses, values that are not finite, poses that turn too little, or about one axis only.
PivotCalibration calibrate_pivot(std::span<const RigidTransform<Tracker, Tool>> tracker_from_tool,
                                 const PivotOptions& options = {});

}  // namespace livetet
