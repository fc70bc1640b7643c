#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <string>
#include <vector>

namespace livetet {

/// Status of a tool's pose. Result files store the numeric values.
/// - `missing`: not seen, or never reported.
/// - `invalid`: the tracker declares it invalid.
/// - `out_of_volume`: outside the tracker's measuring volume.
/// - `stale`: reported before, but not recently.
/// - `broken`: not finite, or not a rigid motion.
enum class PoseStatus { ok, missing, invalid, out_of_volume, stale, broken };

/// Pose of one tracked tool in the tracker's frame; the rotation is re-orthonormalised, the
/// translation in metres.
struct TrackedPose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    PoseStatus status = PoseStatus::missing;
};

/// The poses of all tools at one time, in the order of the recording's or stream's tool names.
struct TrackerSample {
    double time_s = 0;
    std::vector<TrackedPose> poses;
};

/// A sequence of samples. `tools[i]` names `samples[*].poses[i]` ("Stylus" for PLUS's
/// StylusToTracker).
struct Recording {
    std::vector<std::string> tools;
    std::vector<TrackerSample> samples;
};

}  // namespace livetet
