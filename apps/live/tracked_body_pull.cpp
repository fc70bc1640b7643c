#include "apps/live/tracked_body.hpp"

namespace livetet {

void TrackedBody::pull(const std::optional<HandPull>& pull) {
    frame_.pull = pull;
    bool is_new = pull.has_value();
    for (Sensor& s : sensors_) {
        if (!s.by_hand) continue;
        if (pull && s.by_hand == pull->number)
            is_new = false;
        else
            s.leaving = true;
    }
    if (!is_new || pull->number == hand_) return;
    hand_ = pull->number;
    SensorOptions of_no_tool;
    of_no_tool.tool.clear();
    SensorPatchOptions options = sensor_patch_options(scene_, of_no_tool);
    options.follower.filter = PoseFilterOptions{.enabled = false};
    options.follower.estimator.position_rms = 1;  // m: a hand that goes less than 5 m is no outlier
    options.drive.base_window_s = 0;
    options.may_slip = false;
    sensors_.push_back({of_no_tool, 0, false, hand_, SensorPatch(options)});
}

/// A hand-pulled marker is a sensor whose tracker frame is the image, with the reference at rest.
void TrackedBody::follow_hand(Sensor& sensor) {
    TrackedPose hand;
    if (!sensor.leaving) {
        hand.translation = sensor.patch.drive().base() ? frame_.pull->to : frame_.pull->base;
        hand.status = PoseStatus::ok;
    }
    sensor.patch.follow(frame_.time_s, hand, RigidTransform<Tracker, Reference>{}, {});
    frame_.press = std::max(frame_.press, sensor.patch.press());
}

}  // namespace livetet
