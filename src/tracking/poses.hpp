#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "geometry/transform.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// Whether a pose may be used: its status is ok and all its numbers are finite.
inline bool is_usable(const TrackedPose& pose) {
    return pose.status == PoseStatus::ok && pose.rotation.allFinite() &&
           pose.translation.allFinite();
}

/// Whether the tracker said anything of the tool for this sample.
inline bool was_reported(const TrackedPose& pose) {
    return pose.status != PoseStatus::missing && pose.status != PoseStatus::stale;
}

/// A tracked pose as a transform: `tracker_from<Reference>(pose)` is tracker_from_reference.
template <class Frame>
RigidTransform<Tracker, Frame> tracker_from(const TrackedPose& pose) {
    return {pose.rotation, pose.translation};
}

/// The way back, with status ok.
template <class Frame>
TrackedPose pose_of(const RigidTransform<Tracker, Frame>& tracker_from_frame) {
    return {tracker_from_frame.rotation, tracker_from_frame.translation, PoseStatus::ok};
}

/// The place of a tool in a recording's samples. Throws Error, listing the tools there are, where
/// it has none of that name.
std::size_t tool_index(const Recording& recording, std::string_view tool);

/// All usable poses of a tool, in order: what a pivot calibration takes.
std::vector<RigidTransform<Tracker, Tool>> usable_poses(const Recording& recording,
                                                        std::string_view tool);

}  // namespace livetet
