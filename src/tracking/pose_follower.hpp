#pragma once

#include <optional>

#include "tracking/lag_meter.hpp"
#include "tracking/pose_filter.hpp"
#include "tracking/pose_smoother.hpp"

namespace livetet {

/// Options of a PoseFollower.
struct PoseFollowerOptions {
    PoseEstimatorOptions estimator{};
    /// Extrapolates the estimates over this time to make up for latency, s; no further than the
    /// estimator's `max_gap_s` after its last accepted pose.
    double ahead_s = 0;
    /// If given, accepted poses are smoothed, and extrapolated, by this filter instead of the
    /// estimator.
    std::optional<PoseFilterOptions> filter{};
};

/// What a PoseFollower has learned of its tool's poses.
struct PoseQuality {
    std::optional<double> lag_s{};  ///< by which the returned poses are late; see LagMeter
    /// RMS errors of the tracker, relative to those of the options; at least 1.
    double position_noise_ratio = 1, rotation_noise_ratio = 1;
};

/// Follows one tool: a PoseEstimator refuses outliers and, unless a filter is given, estimates the
/// pose. Also measures by how much the poses that it returns lag. Allocates nothing.
class PoseFollower {
  public:
    /// Throws Error as PoseEstimator and PoseFilter do, and if `ahead_s` is not from 0 to the
    /// estimator's `max_gap_s`.
    explicit PoseFollower(const PoseFollowerOptions& options = {});

    struct Result {
        /// The pose to use: of an outlier, the prediction or the filter's last accepted pose; of an
        /// unusable pose, the same.
        TrackedPose pose;
        /// The measured pose, or the estimate at its time if the sample repeats the last one;
        /// missing if it may not be used. For products with another tool's pose.
        TrackedPose unfiltered;
        PoseVerdict verdict = PoseVerdict::unusable;  ///< never `repeated`: that of the last one
    };
    /// Processes a pose measured at `time_s`. If `ahead_s` is given, it takes the place of the
    /// option in this call; a filter has its own. Throws Error if it is not from 0 to the
    /// estimator's `max_gap_s`.
    Result update(double time_s, const TrackedPose& measured, std::optional<double> ahead_s = {});

    /// As PoseEstimator::set_noise.
    void set_noise(double position_rms, double rotation_rms) {
        smoother_.set_noise(position_rms, rotation_rms);
    }
    const PoseEstimator& estimator() const { return smoother_.estimator(); }
    /// The estimate that the last returned pose is, with its covariance; empty if that is none:
    /// with a filter, or while nothing usable came.
    const std::optional<PoseEstimate>& used() const { return used_; }
    PoseQuality quality() const {
        return {lag_.lag_s(), estimator().position_noise_ratio(),
                estimator().rotation_noise_ratio()};
    }

  private:
    void check_ahead(double ahead_s) const;
    Result again(double time_s, double ahead_s);
    TrackedPose used_at(double time_s, double ahead_s);
    std::optional<PoseEstimate> estimated(double time_s, double ahead_s) const;

    PoseSmoother smoother_;
    LagMeter lag_;
    double ahead_s_, max_gap_s_;
    std::optional<PoseFilter> filter_;
    TrackedPose accepted_;
    std::optional<PoseEstimate> used_;
    PoseVerdict verdict_ = PoseVerdict::unusable;
};

}  // namespace livetet
