#pragma once

#include "apps/scene/scene.hpp"
#include "tracking/pose_follower.hpp"
#include "tracking/sensor_patch.hpp"

namespace livetet {

/// The time by which the scene extrapolates poses, s; 0 if it says `auto`.
double fixed_ahead_s(const TrackOptions& track);

/// How the scene filters the pose of one tool.
PoseFollowerOptions pose_follower_options(const TrackOptions& track);

/// Options of a sensor's patch in this scene.
SensorPatchOptions sensor_patch_options(const Scene& scene, const SensorOptions& sensor);

}  // namespace livetet
