#include "tracking/sensor_drive.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"

namespace livetet {

namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// Moves `now` towards `target` by at most `step`; returns true on arrival.
bool approach(Vector3d& now, const Vector3d& target, double step) {
    const Vector3d way = target - now;
    const bool there = way.norm() <= step;
    now = there ? target : Vector3d(now + step * way.normalized());
    return there;
}

}  // namespace

SensorDrive::SensorDrive(const SensorDriveOptions& options)
    : options_(options),
      rest_({options.base_window_s, options.max_base_scatter, options.max_base_drift}) {
    const auto not_negative = [](const char* name, double value) {
        if (!(value >= 0)) fail("sensor drive: {} = {} must be >= 0", name, value);
    };
    not_negative("base_window_s", options.base_window_s);
    not_negative("hold_s", options.hold_s);
    not_negative("release_s", options.release_s);
    if (!(options.max_base_scatter > 0))
        fail("sensor drive: max_base_scatter = {} m must be > 0", options.max_base_scatter);
    if (!(options.max_base_drift > 0))
        fail("sensor drive: max_base_drift = {} m must be > 0", options.max_base_drift);
    if (!(options.max_displacement > 0))
        fail("sensor drive: max_displacement = {} m must be > 0", options.max_displacement);
    if (!(options.max_return_speed > 0))
        fail("sensor drive: max_return_speed = {} m/s must be > 0", options.max_return_speed);
    if (!(options.max_return_turn_rate > 0))
        fail("sensor drive: max_return_turn_rate = {} rad/s must be > 0",
             options.max_return_turn_rate);
}

DriveStatus SensorDrive::update(
    double time_s, const std::optional<RigidTransform<ImageFrame, Sensor>>& image_from_sensor) {
    const double now = last_s_ ? std::max(time_s, *last_s_) : time_s;
    const double dt = last_s_ ? now - *last_s_ : 0;
    last_s_ = now;
    const bool finite = image_from_sensor && image_from_sensor->rotation.allFinite() &&
                        image_from_sensor->translation.allFinite();
    too_far_ = false;
    if (!base_) {
        if (now - seen_s_ > options_.hold_s && !finite)
            rest_.restart();  // the sensor may return at another place
        if (!finite) return status_;
        seen_s_ = now;
        place(now, *image_from_sensor);
    } else {
        const Motion target = finite ? motion_to(*image_from_sensor) : Motion{};
        too_far_ = finite && target.translation.norm() > options_.max_displacement;
        if (finite && !too_far_) {
            seen_s_ = now;
            follow(dt, target);
        } else {
            release(now);
        }
    }
    return status_;
}

void SensorDrive::place(double time_s,
                        const RigidTransform<ImageFrame, Sensor>& image_from_sensor) {
    if (rest_.add(time_s, image_from_sensor) != RestAverage::State::complete) return;
    base_ = rest_.mean();
    status_ = DriveStatus::following;
}

SensorDrive::Motion SensorDrive::motion_to(
    const RigidTransform<ImageFrame, Sensor>& image_from_sensor) const {
    Motion target;
    target.translation = image_from_sensor.translation - base_->translation;
    if (options_.motion == DriveMotion::rigid)
        target.turn = rotation_vector(image_from_sensor.rotation * base_->rotation.transpose());
    return target;
}

void SensorDrive::follow(double dt, const Motion& target) {
    if (status_ == DriveStatus::following) {
        motion_ = target;
        return;
    }
    const bool there =
        approach(motion_.translation, target.translation, options_.max_return_speed * dt);
    const bool turned = approach(motion_.turn, target.turn, options_.max_return_turn_rate * dt);
    grip_ = options_.release_s > 0 ? std::min(1.0, grip_ + dt / options_.release_s) : 1.0;
    status_ = there && turned && grip_ == 1 ? DriveStatus::following : DriveStatus::returning;
}

void SensorDrive::release(double time_s) {
    const double away = time_s - seen_s_ - options_.hold_s;
    if (away <= 0) {
        status_ = DriveStatus::holding;
        return;
    }
    grip_ = std::min(grip_,
                     options_.release_s > 0 ? std::max(0.0, 1 - away / options_.release_s) : 0.0);
    status_ = grip_ > 0 ? DriveStatus::releasing : DriveStatus::released;
}

Vector3d SensorDrive::displacement(const Vector3d& rest_position) const {
    if (!base_) return Vector3d::Zero();
    const Vector3d arm = rest_position - base_->translation;
    return motion_.translation + rotation_of_vector(motion_.turn) * arm - arm;
}

}  // namespace livetet
