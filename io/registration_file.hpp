#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/transform.hpp"

namespace livetet {

/// What a fiducial registration knows of one fiducial. Metres.
struct RegisteredFiducial {
    std::string name;
    Eigen::Vector3d in_image = Eigen::Vector3d::Zero();
    Eigen::Vector3d in_tracker = Eigen::Vector3d::Zero();
    Eigen::Vector3d in_reference = Eigen::Vector3d::Zero();  ///< only where a reference sensor was given
    double residual = 0;
    double leave_one_out = 0;  ///< NaN where the others do not determine a fit
};

/// A fiducial registration as it is kept between `livetet register` and `livetet track`.
struct FiducialRegistration {
    std::vector<RegisteredFiducial> fiducials;
    std::string reference_tool;  ///< empty: registered in the tracker's frame only
    SimilarityTransform<ImageFrame, Tracker> image_from_tracker;
    double fre = 0;
    double fle = 0;  ///< estimated from FRE
};

/// JSON, lengths in mm, matrices as 16 numbers by rows.
void write_registration(const std::filesystem::path& path, const FiducialRegistration& registration);

/// Throws Error, naming file and key, where something is missing, of another type or not finite.
FiducialRegistration read_registration(const std::filesystem::path& path);

}  // namespace livetet
