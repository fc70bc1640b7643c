#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <vector>

#include "geometry/transform.hpp"

namespace livetet {

/// Whether a registration may stretch: `rigid` keeps s = 1, `similarity` estimates s.
enum class Scaling { rigid, similarity };

/// The least-squares fit x_i = scale * rotation * p_i + translation of points p to points x (both
/// in metres).
struct PointFit {
    double scale = 1;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector3d>
        residuals;   ///< scale * rotation * p_i + translation - x_i, metres, one for each point
    double fre = 0;  ///< fiducial registration error: (weighted) RMS of |residual|, metres

    Eigen::Vector3d operator*(const Eigen::Vector3d& p) const {
        return scale * (rotation * p) + translation;
    }
};

/// Umeyama (1991), "Least-squares estimation of transformation parameters between two point
/// patterns", IEEE PAMI 13(4), eqs. 40 to 43: with H = sum_i w_i (x_i - mean x)(p_i - mean p)^T = U
/// D V^T, R = U diag(1, 1, det(U V^T)) V^T, and s = tr(D diag(1, 1, det(U V^T))) / sum_i w_i |p_i -
/// mean p|^2. Never a reflection. `from` and `to` have one point each for each fiducial, in the
/// same order; `weights` (not negative) as many, or none. Throws Error for unequal counts, fewer
/// than 3 points (of weight above zero), values that are not finite, and points that coincide or
/// lie on a line, on either side.
PointFit fit_points(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                    Scaling scaling, std::span<const double> weights = {});

/// The same fit by unit quaternions: Horn (1987), "Closed-form solution of absolute orientation
/// using unit quaternions", JOSA A 4(4): the eigenvector of the largest eigenvalue of his 4 x 4
/// matrix N. Scale as in `fit_points`. An independent check of it; same arguments, same errors.
PointFit fit_points_horn(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                         Scaling scaling, std::span<const double> weights = {});

/// Throws Error where two fits of the same points put one of `from` farther apart than rounding
/// (1e-8 of the spread of `to`): saying so, or, where their FRE is the same, that the points have
/// no one best rotation.
void check_agreement(const PointFit& a, const PointFit& b, std::span<const Eigen::Vector3d> from,
                     std::span<const Eigen::Vector3d> to);

/// `fit_points`, checked by `fit_points_horn`.
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

/// A similarity of scale 1 as a rigid transform: for registrations made with Scaling::rigid.
template <class To, class From>
RigidTransform<To, From> rigid_part(const SimilarityTransform<To, From>& similarity) {
    if (similarity.scale != 1)
        fail("registration: scale is {}, expected 1 for a rigid transform", similarity.scale);
    return {similarity.rotation, similarity.translation};
}

}  // namespace livetet
