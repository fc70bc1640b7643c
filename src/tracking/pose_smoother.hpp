#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "tracking/pose_estimator.hpp"

namespace livetet {

/// Estimates poses a short time late, from the samples before and after, with less noise and less
/// lag than any estimate in time. Runs a PoseEstimator forwards and, over the lag, the recursion of
/// Rauch, Tung and Striebel backwards for each motion model; the models are weighed by their latest
/// probabilities, as if the model did not change within the lag. Allocates nothing.
/// Sources: Rauch, Tung, Striebel (1965), "Maximum likelihood estimates of linear dynamic systems",
/// AIAA Journal 3(8); Blom and Bar-Shalom (1988) as for MotionFilter.
class PoseSmoother {
  public:
    /// `lag_s`: how late the estimates may be. Throws Error if it is not from 0 to 1 s, or as
    /// PoseEstimator does.
    explicit PoseSmoother(const PoseEstimatorOptions& options = {}, double lag_s = 0.065);

    PoseVerdict update(double time_s, const TrackedPose& pose);

    /// The estimate at the newest sample that is at least the lag older than the last one, or at
    /// the oldest since the start (or of the last 127) where none is; `time_s` tells its time.
    /// Empty before the first pose.
    std::optional<PoseEstimate> smoothed() const;

    const PoseEstimator& estimator() const { return estimator_; }
    /// As PoseEstimator::set_noise.
    void set_noise(double position_rms, double rotation_rms) {
        estimator_.set_noise(position_rms, rotation_rms);
    }

  private:
    /// A sample and the models before the time update from it to the next one.
    struct Step {
        double time_s = 0;
        Eigen::Quaterniond anchor = Eigen::Quaterniond::Identity();
        std::array<MotionGaussian, motion_models> translation, rotation;
    };

    PoseEstimator estimator_;
    double lag_s_;
    std::array<Step, 127> steps_;  // used as a ring
    std::size_t first_ = 0, count_ = 0;
};

}  // namespace livetet
