#include "tracking/pose_estimator.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

void check_above_0(const char* name, double value) {
    if (!(value > 0 && std::isfinite(value)))
        fail("pose estimator: {} = {} must be finite and > 0", name, value);
}

void check_densities(const char* name, const PerMotionModel& values) {
    for (const double value : values) check_above_0(name, value);
    if (!std::is_sorted(values.begin(), values.end()))
        fail("pose estimator: {} = {} must ascend", name, fmt::join(values, ", "));
}

void check_options(const PoseEstimatorOptions& o) {
    check_above_0("position_rms", o.position_rms);
    check_above_0("rotation_rms", o.rotation_rms);
    check_densities("acceleration_densities", o.acceleration_densities);
    check_densities("turn_acceleration_densities", o.turn_acceleration_densities);
    double sum = 0;
    for (const double share : o.model_shares) {
        check_above_0("model_shares", share);
        sum += share;
    }
    if (!(std::abs(sum - 1) < 1e-9))
        fail("pose estimator: model_shares sum to {}, expected 1", sum);
    check_above_0("change_rate", o.change_rate);
    check_above_0("start_speed", o.start_speed);
    check_above_0("start_turn_rate", o.start_turn_rate);
    if (!(o.gate_probability > 0 && o.gate_probability < 0.1))
        fail("pose estimator: gate_probability = {} must be > 0 and < 0.1", o.gate_probability);
    if (o.max_held < 0) fail("pose estimator: max_held = {} must be >= 0", o.max_held);
    check_above_0("max_held_s", o.max_held_s);
    check_above_0("max_gap_s", o.max_gap_s);
}

/// What a chi-square variable with 6 degrees of freedom exceeds with probability p: x = 2 y with
/// exp(-y) (1 + y + y^2 / 2) = p. The fixed point contracts by y^2 / 2 / (1 + y + y^2 / 2).
double chi_square_6(double p) {
    double y = 0;
    for (int i = 0; i < 1000; ++i) y = std::log((1 + y + y * y / 2) / p);
    return 2 * y;
}

}  // namespace

void PoseState::advance(double to_s) {
    const double dt = std::max(0.0, to_s - time_s);
    time_s = std::max(time_s, to_s);
    translation.advance(dt);
    rotation.advance(dt);
    const Vector3d turn = rotation.now().merged().mean.row(0);
    anchor = (Quaterniond(rotation_of_vector(turn)) * anchor).normalized();
    rotation.move_origin(turn);
}

Vector3d PoseState::from_anchor(const Matrix3d& to) const {
    return rotation_vector(to * anchor.toRotationMatrix().transpose());
}

PoseEstimate pose_estimate(double time_s, const MotionMixture& translation,
                           const MotionMixture& rotation, const Quaterniond& anchor) {
    const MotionGaussian along = translation.merged(), about = rotation.merged();
    PoseEstimate estimate;
    estimate.time_s = time_s;
    estimate.rotation = rotation_of_vector(about.mean.row(0)) * anchor.toRotationMatrix();
    estimate.translation = along.mean.row(0);
    estimate.covariance.topLeftCorner<3, 3>() = translation.position_covariance();
    estimate.covariance.bottomRightCorner<3, 3>() = rotation.position_covariance();
    estimate.velocity = along.mean.row(1);
    estimate.angular_velocity = about.mean.row(1);
    estimate.translation_models = translation.probability;
    estimate.rotation_models = rotation.probability;
    return estimate;
}

PoseEstimator::PoseEstimator(const PoseEstimatorOptions& options)
    : options_(options),
      state_{0,
             MotionFilter({options.position_rms, options.acceleration_densities,
                           options.model_shares, options.change_rate, options.start_speed}),
             MotionFilter({options.rotation_rms, options.turn_acceleration_densities,
                           options.model_shares, options.change_rate, options.start_turn_rate})} {
    check_options(options);
    gate_ = chi_square_6(options.gate_probability);
}

void PoseEstimator::start(double time_s, const TrackedPose& pose) {
    state_.time_s = time_s;
    state_.anchor = Quaterniond(pose.rotation).normalized();
    state_.translation.start(pose.translation);
    state_.rotation.start(Vector3d::Zero());
    accepted_s_ = time_s;
    held_ = 0;
}

PoseVerdict PoseEstimator::update(double time_s, const TrackedPose& pose) {
    if (!is_usable(pose) || !std::isfinite(time_s)) return PoseVerdict::unusable;
    if (!accepted_s_ || std::abs(time_s - *accepted_s_) > options_.max_gap_s) {
        start(time_s, pose);
        return PoseVerdict::started;
    }
    return time_s >= state_.time_s + min_interval_s ? take(time_s, pose) : PoseVerdict::repeated;
}

PoseVerdict PoseEstimator::take(double time_s, const TrackedPose& pose) {
    state_.advance(time_s);
    const Vector3d turn = state_.from_anchor(pose.rotation);
    const double distance = state_.translation.squared_distance(pose.translation) +
                            state_.rotation.squared_distance(turn);
    state_.translation.learn_noise(pose.translation);
    state_.rotation.learn_noise(turn);
    if (distance > gate_) {
        if (held_ < options_.max_held && time_s <= *accepted_s_ + options_.max_held_s) {
            ++held_;
            return PoseVerdict::held;
        }
        start(time_s, pose);
        return PoseVerdict::started;
    }
    state_.translation.correct(pose.translation);
    state_.rotation.correct(turn);
    accepted_s_ = time_s;
    held_ = 0;
    return PoseVerdict::accepted;
}

void PoseEstimator::set_noise(double position_rms, double rotation_rms) {
    check_above_0("position_rms", position_rms);
    check_above_0("rotation_rms", rotation_rms);
    state_.translation.set_noise(options_.position_rms = position_rms);
    state_.rotation.set_noise(options_.rotation_rms = rotation_rms);
}

std::optional<PoseEstimate> PoseEstimator::predict(double time_s) const {
    if (!accepted_s_ || !(time_s <= *accepted_s_ + options_.max_gap_s)) return {};
    PoseState at = state_;
    at.advance(time_s);
    return pose_estimate(at.time_s, at.translation.now(), at.rotation.now(), at.anchor);
}

}  // namespace livetet
