#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>

#include "geometry/transform.hpp"

namespace livetet {

/// Acceptance limits of a pivot calibration.
struct PivotOptions {
    /// Poses whose distance from the pivot exceeds the median by more than this many robust
    /// standard deviations are rejected; none: keep all.
    std::optional<double> reject_beyond_sigma = 3;
    std::size_t min_poses = 10;
    double min_spread_deg = 15;  ///< minimum of the largest rotation between two poses
    /// Minimum ratio of the smallest to the largest singular value. Below it the tool turned about
    /// one axis only; 0.3 degrees of noise give 0.004.
    double min_singular_ratio = 0.02;
};

/// Result of a pivot calibration, with its quality.
struct PivotCalibration {
    RigidTransform<Tool, Tip> tool_from_tip;                     ///< translation only
    Eigen::Vector3d pivot_in_tracker = Eigen::Vector3d::Zero();  ///< metres
    /// RMS distance between R_i tip + t_i and the pivot over the poses used, metres.
    double rms = 0;
    std::size_t used = 0;
    std::size_t rejected = 0;
    double spread_deg = 0;  ///< largest rotation between two of the poses used
    double condition = 0;   ///< ratio of the largest to the smallest singular value of the system
    /// Number of singular values above min_singular_ratio times the largest; 6 if all unknowns are
    /// determined.
    int rank = 0;
    /// Covariance of (tip in the tool's frame, pivot in the tracker's), m^2. Empty for a result
    /// read from a tip file, which holds the part of the tip alone.
    std::optional<Eigen::Matrix<double, 6, 6>> covariance;
};

/// Pivot calibration: finds a tool's tip from poses of the tool turning about its resting tip.
/// Solves R_i tip + t_i = pivot for all poses (R_i, t_i) = tracker_from_tool[i], that is
///
///     [R_i | -I] [tip; pivot] = -t_i
///
/// in the least-squares sense (Yaniv 2015, "Which pivot calibration?", SPIE 9415, "algebraic
/// one-step"). Rejects poses farther from the pivot than median + `reject_beyond_sigma` * 1.4826
/// MAD and fits again until no pose is rejected. With A the matrix above of the n poses used and r
/// their residuals, the covariance is
///
///     (sum_k rho_k) |r|^2 / (3 n - 6) (A^T A)^-1
///
/// with rho_k the correlation of residuals k poses apart (rho_0 = 1): poses in order of time, a few
/// ms apart, have much the same error. Errors of equal variance in all directions are assumed.
/// Throws Error if there are too few poses, if a
/// value is not finite, or if the poses turn too little or about one axis only.
PivotCalibration calibrate_pivot(std::span<const RigidTransform<Tracker, Tool>> tracker_from_tool,
                                 const PivotOptions& options = {});

}  // namespace livetet
