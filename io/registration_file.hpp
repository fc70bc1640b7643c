#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/transform.hpp"

namespace livetet {

/// What a fiducial registration knows of one fiducial. Metres.
struct RegisteredFiducial {
    std::string name;
    Eigen::Vector3d in_image = Eigen::Vector3d::Zero();
    Eigen::Vector3d in_tracker = Eigen::Vector3d::Zero();
    Eigen::Vector3d in_reference =
        Eigen::Vector3d::Zero();  ///< only where a reference sensor was given
    double residual = 0;          ///< of the fit by fiducials
    double leave_one_out = 0;     ///< NaN where the others do not determine a fit
    double weight = 1;
};

/// What points on the organ's surface made of it, after the fiducials. Metres.
struct RegisteredSurface {
    std::size_t points = 0, used = 0;
    double rms_before = 0, rms_after = 0;  ///< distances from the surface of the points used
    int iterations = 0;
    std::size_t free_motions =
        0;  ///< motions that the points do not hold: the fiducials' word stands
};

/// A registration as it is kept between `livetet register` and `livetet track`.
struct FiducialRegistration {
    std::vector<RegisteredFiducial> fiducials;
    std::string reference_tool;  ///< empty: registered in the tracker's frame only
    SimilarityTransform<ImageFrame, Base> image_from_base;
    double fre = 0;
    double fle = 0;                      ///< estimated from FRE, of weight 1
    std::optional<std::string> outlier;  ///< the fiducial that does not belong to the others
    std::optional<RegisteredSurface> surface;
};

/// JSON, lengths in mm, matrices as 16 numbers by rows.
void write_registration(const std::filesystem::path& path,
                        const FiducialRegistration& registration);

/// Throws Error, naming file and key, where something is missing, of another type or not finite,
/// and where the matrix is no turn, scale and shift.
FiducialRegistration read_registration(const std::filesystem::path& path);

}  // namespace livetet
