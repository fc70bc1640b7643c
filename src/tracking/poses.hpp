#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "geometry/transform.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// A sample of a tool that comes less than this after the last one repeats it, s.
inline constexpr double min_interval_s = 1e-6;

/// Coordinates of a tool that are larger can only be an error, m; squares of all others are finite.
inline constexpr double max_tracked_coordinate = 1e3;

/// Whether a pose is valid: its status is ok, and all its numbers are finite and possible.
inline bool is_usable(const TrackedPose& pose) {
    return pose.status == PoseStatus::ok && pose.rotation.allFinite() &&
           pose.translation.allFinite() &&
           pose.translation.cwiseAbs().maxCoeff() <= max_tracked_coordinate;
}

/// Whether the tracker reported the tool in this sample, with whatever status.
inline bool was_reported(const TrackedPose& pose) {
    return pose.status != PoseStatus::missing && pose.status != PoseStatus::stale;
}

/// A tracked pose as a transform; `tracker_from<Reference>(pose)` is tracker_from_reference.
template <class Frame>
RigidTransform<Tracker, Frame> tracker_from(const TrackedPose& pose) {
    return {pose.rotation, pose.translation};
}

/// Inverse of `tracker_from`, with status ok.
template <class Frame>
TrackedPose pose_of(const RigidTransform<Tracker, Frame>& tracker_from_frame) {
    return {tracker_from_frame.rotation, tracker_from_frame.translation, PoseStatus::ok};
}

/// Index of a tool in a recording's samples. Throws Error, listing the tools that exist, if there
/// is none of that name.
std::size_t tool_index(const Recording& recording, std::string_view tool);

/// All usable poses of a tool in time order: the input of a pivot calibration.
std::vector<RigidTransform<Tracker, Tool>> usable_poses(const Recording& recording,
                                                        std::string_view tool);

}  // namespace livetet
