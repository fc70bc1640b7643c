#include "tracking/sensor_drive.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"

namespace livetet {

namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d rotation_vector(const Matrix3d& rotation) {
    const AngleAxisd turn(rotation);
    return turn.angle() * turn.axis();
}

// From `now` towards `target` by at most `step`; true when there.
bool approach(Vector3d& now, const Vector3d& target, double step) {
    const Vector3d way = target - now;
    const bool there = way.norm() <= step;
    now = there ? target : Vector3d(now + step * way.normalized());
    return there;
}

}  // namespace

SensorDrive::SensorDrive(const SensorDriveOptions& options) : options_(options) {
    const auto not_negative = [](const char* name, double value) {
        if (!(value >= 0)) fail("sensor drive: {} = {} must be >= 0", name, value);
    };
    not_negative("base_window_s", options.base_window_s);
    not_negative("hold_s", options.hold_s);
    not_negative("release_s", options.release_s);
    if (!(options.max_return_speed > 0))
        fail("sensor drive: max_return_speed = {} m/s must be > 0", options.max_return_speed);
    if (!(options.max_return_turn_rate > 0))
        fail("sensor drive: max_return_turn_rate = {} rad/s must be > 0", options.max_return_turn_rate);
}

DriveStatus SensorDrive::update(double time_s,
                                const std::optional<RigidTransform<ImageFrame, Sensor>>& image_from_sensor) {
    const double now = last_s_ ? std::max(time_s, *last_s_) : time_s;
    const double dt = last_s_ ? now - *last_s_ : 0;
    last_s_ = now;
    const bool seen =
        image_from_sensor && image_from_sensor->rotation.allFinite() && image_from_sensor->translation.allFinite();
    if (seen) {
        seen_s_ = now;
        if (base_)
            follow(dt, *image_from_sensor);
        else
            place(now, *image_from_sensor);
    } else if (base_) {
        release(now);
    }
    return status_;
}

void SensorDrive::place(double time_s, const RigidTransform<ImageFrame, Sensor>& pose) {
    if (!first_s_) first_s_ = time_s;
    rotation_sum_ += pose.rotation;
    translation_sum_ += pose.translation;
    ++poses_;
    if (time_s - *first_s_ < options_.base_window_s) return;
    base_ = RigidTransform<ImageFrame, Sensor>{nearest_rotation(rotation_sum_), translation_sum_ / poses_};
    status_ = DriveStatus::following;
}

void SensorDrive::follow(double dt, const RigidTransform<ImageFrame, Sensor>& pose) {
    Motion target;
    target.translation = pose.translation - base_->translation;
    if (options_.motion == DriveMotion::rigid)
        target.turn = rotation_vector(pose.rotation * base_->rotation.transpose());
    if (status_ != DriveStatus::following) {
        const bool there = approach(motion_.translation, target.translation, options_.max_return_speed * dt);
        const bool turned = approach(motion_.turn, target.turn, options_.max_return_turn_rate * dt);
        status_ = there && turned ? DriveStatus::following : DriveStatus::returning;
    } else {
        motion_ = target;
    }
    held_ = motion_;
}

void SensorDrive::release(double time_s) {
    const double away = time_s - seen_s_;
    if (away <= options_.hold_s) {
        status_ = DriveStatus::holding;
        return;
    }
    const double faded = options_.release_s > 0 ? std::min(1.0, (away - options_.hold_s) / options_.release_s) : 1.0;
    const double left = 1 - faded * faded * (3 - 2 * faded);  // smooth at both ends
    motion_ = {left * held_.turn, left * held_.translation};
    status_ = faded < 1 ? DriveStatus::releasing : DriveStatus::released;
}

Vector3d SensorDrive::displacement(const Vector3d& rest_position) const {
    if (!base_) return Vector3d::Zero();
    const Vector3d arm = rest_position - base_->translation;
    return motion_.translation + rotation_of_vector(motion_.turn) * arm - arm;
}

}  // namespace livetet
