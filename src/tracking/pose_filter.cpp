#include "tracking/pose_filter.hpp"

#include <cmath>
#include <numbers>

#include "base/error.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

double smoothing_factor(double cutoff_Hz, double dt) {
    return 1 / (1 + 1 / (2 * std::numbers::pi * cutoff_Hz * dt));
}

void check_positive(const char* name, double value) {
    if (!(value > 0) || !std::isfinite(value))
        fail("pose filter: {} = {} must be > 0", name, value);
}

}  // namespace

PoseFilter::PoseFilter(const PoseFilterOptions& options) : options_(options) {
    check_positive("min_cutoff_Hz", options.min_cutoff_Hz);
    check_positive("derivative_cutoff_Hz", options.derivative_cutoff_Hz);
    check_positive("reset_after_s", options.reset_after_s);
    if (!(options.ahead_s >= 0 && options.ahead_s <= 1))
        fail("pose filter: ahead_s = {} must be from 0 to 1", options.ahead_s);
    if (!(options.beta_per_m >= 0))
        fail("pose filter: beta_per_m = {} must be >= 0", options.beta_per_m);
    if (!(options.beta_per_rad >= 0))
        fail("pose filter: beta_per_rad = {} must be >= 0", options.beta_per_rad);
}

TrackedPose PoseFilter::update(double time_s, const TrackedPose& pose) {
    if (!options_.enabled || !is_usable(pose) || !std::isfinite(time_s)) return pose;
    const bool gap = state_ && std::abs(time_s - state_->time_s) > options_.reset_after_s;
    if (!state_ || gap) {
        state_ = State{time_s,           pose,          pose.translation,
                       Vector3d::Zero(), pose.rotation, Vector3d::Zero()};
        return pose;
    }
    State& s = *state_;
    const double dt = time_s - s.time_s;
    if (dt < min_interval_s) return extrapolated();
    const double blend = smoothing_factor(options_.derivative_cutoff_Hz, dt);
    s.velocity += blend * ((pose.translation - s.last_translation) / dt - s.velocity);
    s.angular_velocity +=
        blend *
        (rotation_vector(pose.rotation * s.last_rotation.transpose()) / dt - s.angular_velocity);
    const double along =
        smoothing_factor(options_.min_cutoff_Hz + options_.beta_per_m * s.velocity.norm(), dt);
    const double about = smoothing_factor(
        options_.min_cutoff_Hz + options_.beta_per_rad * s.angular_velocity.norm(), dt);
    s.filtered.translation += along * (pose.translation - s.filtered.translation);
    const Quaterniond from(s.filtered.rotation), to(pose.rotation);
    s.filtered.rotation = from.slerp(about, to).normalized().toRotationMatrix();
    s.filtered.status = PoseStatus::ok;
    s.last_translation = pose.translation;
    s.last_rotation = pose.rotation;
    s.time_s = time_s;
    return extrapolated();
}

TrackedPose PoseFilter::extrapolated() const {
    const State& s = *state_;
    if (options_.ahead_s == 0) return s.filtered;
    return {rotation_of_vector(options_.ahead_s * s.angular_velocity) * s.filtered.rotation,
            s.filtered.translation + options_.ahead_s * s.velocity, PoseStatus::ok};
}

}  // namespace livetet
