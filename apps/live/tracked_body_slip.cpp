#include <algorithm>

#include "apps/live/tracked_body.hpp"

namespace livetet {

/// Judges only while the model follows all sensors: a patch that is held, let go or pulled by hand
/// moves the model, and not the organ.
void TrackedBody::judge_slips() {
    note_others();
    if (settling_) {
        for (Sensor& s : sensors_) s.patch.leave_ring_out();
        return;
    }
    const bool all_follow = std::ranges::all_of(sensors_, [](const Sensor& s) {
        return s.by_hand == 0 &&
               (s.patch.nodes().empty() || s.patch.drive().status() == DriveStatus::following);
    });
    if (!all_follow) return;
    std::size_t k = 0;
    for (Sensor& s : sensors_) {
        const auto response = ring_response(s);
        if (response || !s.had_others)
            s.patch.judge_slip(frame_.time_s, frame_.displacement, response);
        if (!s.leaving) frame_.sensors[k++].trouble = s.patch.trouble();
    }
}

/// Marks the sensors that are not alone. A marker pulled by hand is no other: it moves no organ.
void TrackedBody::note_others() {
    const auto is_placed = [](const Sensor& s) { return !s.by_hand && !s.patch.nodes().empty(); };
    const bool are_several = std::ranges::count_if(sensors_, is_placed) > 1;
    for (Sensor& s : sensors_) s.had_others = is_placed(s) && (s.had_others || are_several);
}

/// None if the sensor has been alone, or while it is not known yet.
std::optional<Eigen::Matrix3d> TrackedBody::ring_response(const Sensor& sensor) const {
    if (!sensor.had_others) return {};
    const TargetResponses* responses =
        stating_.statement ? &stating_.statement->responses() : stating_.for_slips.get();
    if (!responses || !responses->failure().empty()) return Eigen::Matrix3d::Zero();
    const auto known = std::ranges::find(stating_.patches, &sensor.patch);
    if (known == stating_.patches.end() || !responses->knows_rings() || stating_.is_outdated)
        return {};
    return responses->ring_response(static_cast<std::size_t>(known - stating_.patches.begin()));
}

void TrackedBody::judge_slips_by(std::unique_ptr<TargetResponses> responses) {
    restart_opening();
    stating_.restart();
    stating_.for_slips = std::move(responses);
}

/// Only where a sensor that may slip needs them.
void TrackedBody::renew_responses_for_slips() {
    const bool are_needed = std::ranges::any_of(
        sensors_, [](const Sensor& s) { return s.had_others && s.options.may_slip; });
    if (!are_needed) stating_.is_outdated = true;
    if (!are_needed || !renew_patches()) return;
    std::vector<ResponsePatch> patches;
    for (const SensorPatch* patch : stating_.patches) patches.push_back(response_patch(*patch));
    stating_.for_slips->start(std::move(patches), stating_.fix);
}

bool TrackedBody::work_on_responses() {
    if (cutting_ && cutting_->opening) return false;  // they would be made anew when it opens
    if (stating_.statement) return stating_.statement->work();
    return stating_.for_slips && stating_.for_slips->work();
}

}  // namespace livetet
