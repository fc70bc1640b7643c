#include <algorithm>

#include "apps/live/tracked_body.hpp"

namespace livetet {

/// Judges only while the model follows all sensors: a patch that is held, let go or pulled by hand
/// moves the model, and not the organ.
void TrackedBody::judge_slips() {
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
        s.patch.judge_slip(frame_.time_s, frame_.displacement);
        if (!s.leaving) frame_.sensors[k++].trouble = s.patch.trouble();
    }
}

}  // namespace livetet
