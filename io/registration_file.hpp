#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/transform.hpp"

namespace livetet {

/// One fiducial of a registration. Metres.
struct RegisteredFiducial {
    std::string name;
    Eigen::Vector3d in_image = Eigen::Vector3d::Zero();
    Eigen::Vector3d in_tracker = Eigen::Vector3d::Zero();
    /// Zero without a reference sensor.
    Eigen::Vector3d in_reference = Eigen::Vector3d::Zero();
    double residual = 0;       ///< of the fit of the fiducials
    double leave_one_out = 0;  ///< error under the fit of the others; NaN if they determine no fit
    double weight = 1;
};

/// Refinement of the registration by points on the organ's surface. Metres.
struct RegisteredSurface {
    std::size_t points = 0, used = 0;
    double rms_before = 0, rms_after = 0;  ///< distances from the surface of the points used
    int iterations = 0;
    /// Number of motions that the surface points do not constrain; the fiducials determine them.
    std::size_t free_motions = 0;
};

/// Expected error of a rigid registration, to first order.
struct ExpectedRegistrationError {
    /// Covariance of (d, a), m and rad, along the axes of the image, as `registration_covariance`
    /// defines it: the image of a point p errs by d + a x (R p).
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    bool holds_tip = false;  ///< whether the error of the tip's calibration is part of it
};

/// The registration that `livetet register` stores for `livetet track`.
struct FiducialRegistration {
    std::vector<RegisteredFiducial> fiducials;
    std::string reference_tool;  ///< empty: registered in the tracker's frame
    SimilarityTransform<ImageFrame, Base> image_from_base;
    double fre = 0;
    double fle = 0;                      ///< estimated from FRE, of weight 1
    std::optional<std::string> outlier;  ///< name of the fiducial that does not match the others
    std::optional<RegisteredSurface> surface;
    /// Of the fit of the fiducials. Empty with a scale, after a refinement by a surface, and in
    /// files of 0.1.0.
    std::optional<ExpectedRegistrationError> expected_error;
};

/// Writes JSON: lengths in mm, matrices as 16 numbers by rows, the covariance as 36.
void write_registration(const std::filesystem::path& path,
                        const FiducialRegistration& registration);

/// Reads the file. Throws Error, naming file and key, if a value is missing, of another type or not
/// finite, if the matrix is not a similarity transform, or if the covariance is none.
FiducialRegistration read_registration(const std::filesystem::path& path);

}  // namespace livetet
