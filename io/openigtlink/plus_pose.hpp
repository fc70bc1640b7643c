#pragma once

#include <optional>
#include <string_view>

#include "geometry/transform.hpp"
#include "tracking/sample.hpp"

namespace livetet {

constexpr double metres_per_mm = 1e-3;

/// PLUS's word for the status of a pose: OK, MISSING, OUT_OF_VIEW ...; what is not known is
/// invalid.
PoseStatus parse_pose_status(std::string_view word);
/// The word that PLUS has for a status.
std::string_view pose_status_word(PoseStatus status);

/// A tracker's 4 x 4 matrix, in mm, with its rotation re-orthonormalised; nothing where it is not
/// finite or not rigid (electromagnetic trackers come within 5e-4 of it; 0.02 is allowed).
std::optional<RigidTransform<Tracker, Tool>> tracker_from_tool_mm(const Eigen::Matrix4d& matrix);

}  // namespace livetet
