#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <optional>

#include "geometry/transform.hpp"
#include "tracking/motion_filter.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// Options of a PoseEstimator.
struct PoseEstimatorOptions {
    // the tracker's accuracy, as its maker states it
    double position_rms = 1.4e-3;                    ///< RMS length of the position error, m
    double rotation_rms = 0.5 * radians_per_degree;  ///< RMS angle of the rotation error

    // MotionFilterOptions of the translation (m) and the rotation (rad)
    PerMotionModel acceleration_densities{1e-6, 2e-4, 5e-3, 0.2};       ///< m^2/s^3
    PerMotionModel turn_acceleration_densities{1e-5, 1e-3, 3e-2, 150};  ///< rad^2/s^3
    PerMotionModel model_shares{0.2, 0.5, 0.29, 0.01};
    double change_rate = 0.5;      ///< 1/s
    double start_speed = 0.05;     ///< m/s
    double start_turn_rate = 0.5;  ///< rad/s

    /// A pose that noise and motion explain with a smaller probability is an outlier.
    double gate_probability = 1e-6;
    int max_held = 3;         ///< after this many outliers in a row the next one is accepted
    double max_held_s = 0.3;  ///< the same after this time since the last accepted pose
    double max_gap_s = 0.5;   ///< a longer time without an accepted pose restarts the estimator
};

/// What an estimator did with a pose.
/// - `accepted`: the estimate includes it.
/// - `started`: the estimate starts at it: the first pose, after a gap, or after outliers.
/// - `held`: an outlier; the estimate is the prediction.
/// - `repeated`: its time is not after the last one, so it is no new sample.
/// - `unusable`: its status is not ok, or its time or a number of it is not finite.
enum class PoseVerdict { accepted, started, held, repeated, unusable };

/// An estimated pose, in the frame of the measured ones (the tracker's).
struct PoseEstimate {
    double time_s = 0;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< m
    /// Covariance of (d, a), m and rad, along the axes of the tracker: the true pose is translation
    /// + d, exp(a) rotation. A point p of the sensor's frame errs by d + a x (rotation * p).
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< m/s
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< rad/s, tracker's axes
    PerMotionModel translation_models{}, rotation_models{};      ///< probabilities
};

/// State of a PoseEstimator at a time. The filter of the rotation follows the rotation vector a of
/// exp(a) anchor; the anchor moves with each time update to the predicted rotation.
struct PoseState {
    double time_s = 0;
    MotionFilter translation, rotation;
    Eigen::Quaterniond anchor = Eigen::Quaterniond::Identity();

    /// Time update; a time before `time_s` counts as `time_s`.
    void advance(double to_s);
    /// Rotation vector from the anchor.
    Eigen::Vector3d from_anchor(const Eigen::Matrix3d& to) const;
};

/// The estimate that two mixtures and an anchor make up.
PoseEstimate pose_estimate(double time_s, const MotionMixture& translation,
                           const MotionMixture& rotation, const Eigen::Quaterniond& anchor);

/// Estimates the pose of a tracked tool from its measured poses: one MotionFilter for the
/// translation and one for the rotation. The rotation's state is an error about a nominal rotation
/// (error-state filter), so any number of turns is followed; it is treated to first order in the
/// error and in the turn between two samples. Allocates nothing.
/// Source: Sola (2017), "Quaternion kinematics for the error-state Kalman filter",
/// arXiv:1711.02508.
class PoseEstimator {
  public:
    /// Throws Error if an option is out of its range.
    explicit PoseEstimator(const PoseEstimatorOptions& options = {});

    /// Processes a pose measured at `time_s`; the times may be irregular. A time far before the
    /// last one (the clock was set back) restarts the estimator.
    PoseVerdict update(double time_s, const TrackedPose& pose);

    /// The tracker's errors from the next sample on, as PoseEstimatorOptions has them. Throws Error
    /// if one is not finite and > 0.
    void set_noise(double position_rms, double rotation_rms);

    /// Time of the last accepted pose, if there is one.
    const std::optional<double>& accepted_s() const { return accepted_s_; }

    /// The estimate at a time, extrapolated if it is after the last sample's; before it, the
    /// estimate at the last sample. Empty before the first pose, and more than `max_gap_s` after
    /// the last accepted one.
    std::optional<PoseEstimate> predict(double time_s) const;

    /// RMS errors of the tracker as learned, relative to the stated ones; at least 1.
    double position_noise_ratio() const { return state_.translation.noise_ratio(); }
    double rotation_noise_ratio() const { return state_.rotation.noise_ratio(); }

    const PoseState& state() const { return state_; }
    void reset() { *this = PoseEstimator(options_); }

  private:
    void start(double time_s, const TrackedPose& pose);
    PoseVerdict take(double time_s, const TrackedPose& pose);

    PoseEstimatorOptions options_;
    double gate_ = 0;  // bound of the squared Mahalanobis distance
    PoseState state_;
    std::optional<double> accepted_s_;
    int held_ = 0;
};

}  // namespace livetet
