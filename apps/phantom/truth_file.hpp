#pragma once

#include <Eigen/Core>

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/transform.hpp"

namespace livetet {

/// A point in the organ and its true displacement.
struct TruthTarget {
    std::string name;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< at rest, metres, RAS
    std::vector<Eigen::Vector3d> displacement;           ///< metres, at each of the truth's depths
};

/// The organ's true pose and press at a sample of the press recording.
struct TruthSample {
    double time_s = 0;  ///< time stamp of the recording
    double depth = 0;   ///< metres
    RigidTransform<Tracker, ImageFrame> tracker_from_image;
};

/// The truth behind a phantom's recordings, in m. Programs under test never read it.
struct Truth {
    Eigen::Vector3d tip_in_tool = Eigen::Vector3d::Zero();
    Eigen::Vector3d pivot_in_tracker = Eigen::Vector3d::Zero();
    Eigen::Vector3d sensor_rest = Eigen::Vector3d::Zero();        ///< in the image
    Eigen::Vector3d press_direction = -Eigen::Vector3d::UnitZ();  ///< in the image, unit length
    double patch_radius = 0.015;
    Eigen::Vector3d reference_rest =
        Eigen::Vector3d::Zero();  ///< position of the reference sensor in the image
    double position_noise = 0;    ///< of each tracked pose, RMS length, m
    double rotation_noise = 0;    ///< of each tracked pose, RMS angle, radians
    std::vector<double> depths;  ///< rising, above 0, m: depths for which displacements were solved
    std::vector<TruthTarget> targets;
    std::vector<TruthSample> samples;
    std::string provenance;  ///< how the displacements were computed
};

/// The true displacement, m, of a target at a press `depth`, m: piecewise linear between 0 and the
/// solved depths; constant beyond the deepest.
Eigen::Vector3d displacement_of(const Truth& truth, const TruthTarget& target, double depth);

/// Throws Error, naming `where` and the entry, if depths do not rise, a target lacks displacements
/// or repeats a name, time stamps go backwards, a number is not finite, or there is no target or
/// sample.
void check_truth(const Truth& truth, const std::string& where);

/// Writes and reads JSON, in the units of its key names. Both throw Error as `check_truth`; reading
/// also if a key is missing or of the wrong type, naming file and key.
void write_truth(const std::filesystem::path& path, const Truth& truth);
Truth read_truth(const std::filesystem::path& path);

}  // namespace livetet
