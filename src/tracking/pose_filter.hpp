#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <optional>

#include "tracking/sample.hpp"

namespace livetet {

struct PoseFilterOptions {
    bool enabled = true;
    double min_cutoff_Hz = 1;  ///< cutoff at rest; lower is smoother
    double beta_per_m =
        50;  ///< increase of the cutoff with speed, Hz per m/s; higher reduces the lag
    double beta_per_rad = 2;          ///< increase of the cutoff with turn rate, Hz per rad/s
    double derivative_cutoff_Hz = 1;  ///< cutoff of the low-pass filter of the speeds
    /// Extrapolates the pose by its smoothed speeds over this time to compensate for latency.
    double ahead_s = 0;
    double reset_after_s = 0.5;  ///< a longer gap restarts the filter
};

/// One-euro filter: exponential smoothing with a cutoff that grows with the speed,
///
///     alpha = 1 / (1 + 1 / (2 pi f_c dt)),   f_c = f_min + beta |speed|
///
/// Translation uses one cutoff, from the norm of the smoothed velocity, so the result does not
/// depend on the choice of axes. Rotation uses slerp by alpha and the smoothed angular velocity.
/// Source: Casiez, Roussel, Vogel (2012), "1 EUR filter: a simple speed-based low-pass filter for
/// noisy input in interactive systems", CHI.
class PoseFilter {
  public:
    /// Throws Error if a cutoff is not positive or a beta is negative.
    explicit PoseFilter(const PoseFilterOptions& options = {});

    /// Returns the smoothed pose at `time_s`. A pose that is not usable (status, NaN) is returned
    /// unchanged and does not affect the filter. A time not after the last one returns the last
    /// result; a time far before it (the clock was set) restarts the filter.
    TrackedPose update(double time_s, const TrackedPose& pose);
    void reset() { state_.reset(); }

  private:
    struct State {
        double time_s = 0;
        TrackedPose filtered;  // without extrapolation
        // last unfiltered translation, m, and smoothed velocity, m/s
        Eigen::Vector3d last_translation, velocity;
        Eigen::Matrix3d last_rotation;
        Eigen::Vector3d angular_velocity;  // rad/s
    };
    TrackedPose extrapolated() const;

    PoseFilterOptions options_;
    std::optional<State> state_;
};

}  // namespace livetet
