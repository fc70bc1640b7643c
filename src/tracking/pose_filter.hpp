#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <optional>

#include "tracking/sample.hpp"

namespace livetet {

struct PoseFilterOptions {
    bool enabled = true;
    double min_cutoff_Hz = 1;  ///< cutoff at rest: lower is smoother
    double beta_per_m = 50;    ///< cutoff added for each m/s of speed: higher lags less, Hz s/m
    double beta_per_rad = 2;   ///< cutoff added for each rad/s of turning, Hz s/rad
    double derivative_cutoff_Hz = 1;  ///< cutoff of the speeds' own low-pass
    double ahead_s =
        0;  ///< the pose is carried on by its smoothed speeds for so long: makes up for latency
    double reset_after_s = 0.5;  ///< a gap longer than this starts afresh
};

/// The one-euro filter of Casiez, Roussel, Vogel (2012), "1 EUR filter: a simple speed-based
/// low-pass filter for noisy input in interactive systems", CHI: exponential smoothing with alpha =
/// 1 / (1 + 1 / (2 pi f_c dt)) and the cutoff f_c = f_min + beta |speed|. Translation: one cutoff
/// from the norm of the smoothed velocity, so that the filter does not depend on the axes.
/// Rotation: slerp by alpha, with the smoothed angular velocity.
class PoseFilter {
  public:
    /// Throws Error for cutoffs that are not positive and negative betas.
    explicit PoseFilter(const PoseFilterOptions& options = {});

    /// The smoothed pose at `time_s`. A pose that is not usable (status, NaN) is given back as it
    /// is and changes nothing. A time not after the last one gives back the last result; one far
    /// before it starts afresh (a clock was set).
    TrackedPose update(double time_s, const TrackedPose& pose);
    void reset() { state_.reset(); }

  private:
    struct State {
        double time_s = 0;
        TrackedPose filtered;                        // not carried on
        Eigen::Vector3d last_translation, velocity;  // unfiltered, and m/s
        Eigen::Matrix3d last_rotation;
        Eigen::Vector3d angular_velocity;  // rad/s
    };
    TrackedPose carried_on() const;

    PoseFilterOptions options_;
    std::optional<State> state_;
};

struct OutlierGateOptions {
    bool enabled = true;
    double max_speed = 2;       ///< m/s
    double max_turn_rate = 20;  ///< rad/s
    double slack = 0.01;        ///< metres that noise may add to a step
    double slack_rad = 0.1;     ///< radians that noise may add to a turn
    int max_held = 3;           ///< after so many rejected poses in a row the next is believed
    double max_held_s = 0.3;    ///< ... or after so long since the last accepted pose
};

enum class GateVerdict { accepted, held, unusable };

/// Rejects a pose that lies farther from the last accepted one than the stated speeds allow: the
/// last accepted pose is given back instead, for `max_held` poses or `max_held_s` at most; then the
/// new place is believed.
class OutlierGate {
  public:
    struct Result {
        TrackedPose pose;
        GateVerdict verdict = GateVerdict::accepted;
    };
    /// Throws Error for limits that are not positive.
    explicit OutlierGate(const OutlierGateOptions& options = {});

    /// A pose that is not usable is given back as it is, and does not count as held.
    Result update(double time_s, const TrackedPose& pose);
    void reset() { *this = OutlierGate(options_); }

  private:
    OutlierGateOptions options_;
    std::optional<TrackedPose> accepted_;
    double accepted_time_s_ = 0;
    int held_ = 0;
};

}  // namespace livetet
