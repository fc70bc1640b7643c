#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <vector>

#include "geometry/transform.hpp"

namespace livetet {

/// Whether a fit estimates a scale: `rigid` fixes s = 1, `similarity` estimates s.
enum class Scaling { rigid, similarity };

/// Least-squares fit x_i = scale * rotation * p_i + translation of points p_i to points x_i
/// (metres).
struct PointFit {
    double scale = 1;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    /// scale * rotation * p_i + translation - x_i for each point, metres.
    std::vector<Eigen::Vector3d> residuals;
    double fre = 0;  ///< fiducial registration error: (weighted) RMS of |residual|, metres

    Eigen::Vector3d operator*(const Eigen::Vector3d& p) const {
        return scale * (rotation * p) + translation;
    }
};

/// Least-squares fit by Umeyama (1991), "Least-squares estimation of transformation parameters
/// between two point patterns", IEEE PAMI 13(4), eqs. 40 to 43. With
///
///     H = sum_i w_i (x_i - mean x)(p_i - mean p)^T = U D V^T,   S = diag(1, 1, det(U V^T)):
///     R = U S V^T,   s = tr(D S) / sum_i w_i |p_i - mean p|^2
///
/// R is never a reflection. `from` and `to` hold corresponding points in the same order; `weights`
/// is empty or holds one weight (not negative) for each. Throws Error if the counts differ, fewer
/// than 3 points have a weight above zero, a value is not finite, or the points of either side
/// coincide or lie on a line.
PointFit fit_points(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                    Scaling scaling, std::span<const double> weights = {});

/// The same fit by unit quaternions, as an independent check: Horn (1987), "Closed-form solution of
/// absolute orientation using unit quaternions", JOSA A 4(4). The rotation is the eigenvector of
/// the largest eigenvalue of his 4 x 4 matrix N; the scale is that of `fit_points`. Same arguments
/// and errors as `fit_points`.
PointFit fit_points_horn(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                         Scaling scaling, std::span<const double> weights = {});

/// Throws Error if two fits of the same points move a point of `from` to places farther apart than
/// rounding explains (1e-8 of the spread of `to`). If both fits have the same FRE, the message says
/// that the points have no unique best rotation.
void check_agreement(const PointFit& a, const PointFit& b, std::span<const Eigen::Vector3d> from,
                     std::span<const Eigen::Vector3d> to);

/// `fit_points`, checked by `check_agreement` with `fit_points_horn`.
PointFit fit_points_cross_checked(std::span<const Eigen::Vector3d> from,
                                  std::span<const Eigen::Vector3d> to, Scaling scaling,
                                  std::span<const double> weights = {});

/// A point-set registration between named frames.
template <class To, class From>
struct Registration {
    SimilarityTransform<To, From> to_from_from;
    std::vector<Eigen::Vector3d> residuals;  ///< in `To`, metres
    double fre = 0;                          ///< metres
};

/// `fit_points` between frames: `register_points<ImageFrame, Tracker>(P, X)` gives
/// image_from_tracker with X_i = s R P_i + t.
template <class To, class From>
Registration<To, From> register_points(std::span<const Eigen::Vector3d> points_in_from,
                                       std::span<const Eigen::Vector3d> points_in_to,
                                       Scaling scaling = Scaling::rigid,
                                       std::span<const double> weights = {}) {
    PointFit fit = fit_points(points_in_from, points_in_to, scaling, weights);
    return {{fit.scale, fit.rotation, fit.translation}, std::move(fit.residuals), fit.fre};
}

/// The rigid transform of a registration made with Scaling::rigid. Throws Error if the scale is not
/// 1.
template <class To, class From>
RigidTransform<To, From> rigid_part(const SimilarityTransform<To, From>& similarity) {
    if (similarity.scale != 1)
        fail("registration: scale is {}, expected 1 for a rigid transform", similarity.scale);
    return {similarity.rotation, similarity.translation};
}

}  // namespace livetet
