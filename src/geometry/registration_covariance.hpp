#pragma once

#include <Eigen/Core>

#include <span>
#include <vector>

namespace livetet {

/// Covariances (m^2) of the places that a registration fits. An empty list stands for no error.
struct FiducialErrors {
    /// Of each point of `from`, along the axes of its frame, without the tip's part.
    std::vector<Eigen::Matrix3d> in_from;
    /// Of each point of the frame that `from` is mapped to, along the axes of that frame.
    std::vector<Eigen::Matrix3d> in_to;
    /// Of the calibrated tip that touched all the points, along the axes of the tool. Each point is
    /// off by the same error, turned by the tool's rotation.
    Eigen::Matrix3d tip = Eigen::Matrix3d::Zero();
    /// Rotation of the tool at each point, or its mean over the dwell: the frame of `from` from the
    /// tool's. Empty: `tip` is given along the axes of `from`, and the tool did not turn between
    /// the points.
    std::vector<Eigen::Matrix3d> from_from_tool;
};

/// Covariance of a rigid registration by points, to first order in their errors.
///
/// `rotation` R is that of the fit x = R p + t of the points p_i in `from` with weights w_i. The
/// result is the covariance of (d, a), m and rad, along the axes of x: the true pose is t + d,
/// exp(a) R, so that a point p errs by d + a x (R p) (as in PoseEstimate). With W the sum of the
/// weights, q_i = R p_i, c their weighted mean and r_i = q_i - c, errors h_i of R p_i - x_i cause
///
///     a = M^-1 sum_i w_i r_i x h_i,   M = sum_i w_i (|r_i|^2 I - r_i r_i^T),
///     d = 1/W sum_i w_i h_i + c x a.
///
/// Source: the linearised weighted fit, as in Danilchenko and Fitzpatrick (2011), "General approach
/// to first-order error prediction in rigid point registration", IEEE TMI 30(3).
/// Throws Error as `fit_points` and `check_covariance` do, if a list has another length than
/// `from`, and if `rotation` or one of `from_from_tool` is none.
Eigen::Matrix<double, 6, 6> registration_covariance(std::span<const Eigen::Vector3d> from,
                                                    const Eigen::Matrix3d& rotation,
                                                    const FiducialErrors& errors,
                                                    std::span<const double> weights = {});

/// Derivative of d + a x `arm` by (d, a).
Eigen::Matrix<double, 3, 6> point_jacobian(const Eigen::Vector3d& arm);

/// Covariance of d + a x `arm`, from that of (d, a). `arm` is R p for a point p that the pose maps.
Eigen::Matrix3d point_covariance(const Eigen::Matrix<double, 6, 6>& covariance,
                                 const Eigen::Vector3d& arm);

}  // namespace livetet
