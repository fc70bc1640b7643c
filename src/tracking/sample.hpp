#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <string>
#include <vector>

namespace livetet {

/// Why a tool has no pose. `missing`: not seen, or never came; `invalid`: the tracker says so;
/// `stale`: it came, but not of late; `broken`: its numbers are not finite or no rigid motion.
/// Results hold these numbers.
enum class PoseStatus { ok, missing, invalid, out_of_volume, stale, broken };

/// One tracked tool's pose in the tracker's frame: rotation re-orthonormalised, translation in
/// metres.
struct TrackedPose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    PoseStatus status = PoseStatus::missing;
};

/// What a tracker says at one moment: a pose for each tool in the recording's (or stream's) order
/// of names.
struct TrackerSample {
    double time_s = 0;
    std::vector<TrackedPose> poses;
};

/// A stretch of samples: `tools[i]` names `samples[*].poses[i]` ("Stylus" for PLUS's
/// StylusToTracker).
struct Recording {
    std::vector<std::string> tools;
    std::vector<TrackerSample> samples;
};

}  // namespace livetet
