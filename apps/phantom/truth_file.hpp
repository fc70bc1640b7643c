#pragma once

#include <Eigen/Core>

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/transform.hpp"

namespace livetet {

/// A point within the organ, and where it truly goes.
struct TruthTarget {
    std::string name;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< at rest, metres, RAS
    std::vector<Eigen::Vector3d> displacement;           ///< metres, at each of the truth's depths
};

/// The organ's true pose and press at a sample of the press recording.
struct TruthSample {
    double time_s = 0;  ///< the recording's own time stamp
    double depth = 0;   ///< metres
    RigidTransform<Tracker, ImageFrame> tracker_from_image;
};

/// What lies behind a phantom's recordings. Metres; the program under test never reads it.
struct Truth {
    Eigen::Vector3d tip_in_tool = Eigen::Vector3d::Zero();
    Eigen::Vector3d pivot_in_tracker = Eigen::Vector3d::Zero();
    Eigen::Vector3d sensor_rest = Eigen::Vector3d::Zero();        ///< in the image
    Eigen::Vector3d press_direction = -Eigen::Vector3d::UnitZ();  ///< in the image, unit length
    double patch_radius = 0.015;
    Eigen::Vector3d reference_rest =
        Eigen::Vector3d::Zero();  ///< the reference sensor's place in the image
    double position_noise = 0;    ///< of each tracked pose, RMS length, metres
    double rotation_noise = 0;    ///< of each tracked pose, RMS angle, radians
    std::vector<double> depths;   ///< metres, rising, above 0: where the displacements were solved
    std::vector<TruthTarget> targets;
    std::vector<TruthSample> samples;
    std::string provenance;  ///< how the displacements were computed
};

/// The true displacement, metres, of a target when the press is `depth` metres deep: piecewise
/// linear between 0 at depth 0 and the solved depths; constant beyond the deepest.
Eigen::Vector3d displacement_of(const Truth& truth, const TruthTarget& target, double depth);

/// Throws Error, naming `where` and the entry, where depths do not rise, a target lacks
/// displacements or shares its name, time stamps go backwards, a number is not finite, or there is
/// no target or no sample.
void check_truth(const Truth& truth, const std::string& where);

/// Writes and reads JSON, in mm as its names say. Both throw Error as `check_truth`; reading also
/// where a key is missing or of another kind, naming file and key.
void write_truth(const std::filesystem::path& path, const Truth& truth);
Truth read_truth(const std::filesystem::path& path);

}  // namespace livetet
