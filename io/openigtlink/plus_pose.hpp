#pragma once

#include <optional>
#include <string_view>

#include "geometry/transform.hpp"
#include "tracking/sample.hpp"

namespace livetet {

constexpr double metres_per_mm = 1e-3;

/// The end of PLUS's transform names: tool "Stylus" has the transform "StylusToTracker".
constexpr std::string_view to_tracker = "ToTracker";

/// Parses PLUS's pose status: OK, MISSING, OUT_OF_VIEW and so on. Unknown words are invalid.
PoseStatus parse_pose_status(std::string_view word);
/// PLUS's word for a pose status.
std::string_view pose_status_word(PoseStatus status);

/// Converts PLUS's transform ProbeToTracker, a 4 x 4 matrix in mm, to tracker_from_probe in metres.
/// Re-orthonormalises the rotation. Nothing if the matrix is not finite or deviates from a rigid
/// transform by more than 0.02 (electromagnetic trackers stay within 5e-4).
std::optional<RigidTransform<Tracker, Tool>> tracker_from_tool_mm(const Eigen::Matrix4d& matrix);

}  // namespace livetet
