#pragma once

#include <Eigen/Core>

#include <string_view>

namespace livetet {

/// The region in which a place lies whose error is Gaussian with mean 0.
struct ErrorEllipsoid {
    /// Semi-axes of the ellipsoid, descending, metres: sqrt(7.815) standard deviations. It contains
    /// the place with a probability of 95 %, or more if a semi-axis is 0.
    Eigen::Vector3d semi_axes = Eigen::Vector3d::Zero();
    /// Directions of the semi-axes: columns of a rotation, along the axes of the covariance.
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    double radius_95 = 0;  ///< radius of the sphere that contains the place with 95 %, metres
};

/// Ellipsoid and radius of an error of this covariance (m^2), to 1e-6 of the radius. Throws Error
/// as `check_covariance` does.
ErrorEllipsoid error_ellipsoid(const Eigen::Matrix3d& covariance);

/// P(|e| <= radius) of an error e of mean 0 and this covariance (m^2). With standard deviations s_0
/// >= s_1 >= s_2 along the principal axes, the mean over the azimuth phi in the plane of the larger
/// two leaves
///
///     P = erf(a) - 1/pi int_0^pi exp(-r^2 / (2 g)) erf(a k) / k dphi,
///     g = s_0^2 cos^2 phi + s_1^2 sin^2 phi,   k^2 = 1 - s_2^2 / g,   a = r / (sqrt(2) s_2).
///
/// The trapezoidal rule integrates it: the integrand is smooth and periodic. The error is below
/// 1e-5 where P >= 0.5 and below 1e-8 where P >= 0.9. Throws Error as `check_covariance` does.
double probability_within(const Eigen::Matrix3d& covariance, double radius);

/// Throws Error, beginning with `what`, if an entry is not finite or if the matrix is not symmetric
/// or not positive semi-definite, up to rounding (1e-9 of its largest eigenvalue).
void check_covariance(const Eigen::Matrix3d& covariance, std::string_view what);

/// The same for three lengths and three angles (m, rad). Its entries are compared as correlations,
/// divided by the standard deviations, since eigenvalues of mixed units have no meaning.
void check_covariance(const Eigen::Matrix<double, 6, 6>& covariance, std::string_view what);

}  // namespace livetet
