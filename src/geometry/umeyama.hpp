#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "geometry/transform.hpp"

namespace livetet {

/// Whether a registration may stretch: `rigid` keeps s = 1, `similarity` estimates s.
enum class Scaling { rigid, similarity };

/// The least-squares fit x_i = scale * rotation * p_i + translation of points p to points x (both in metres).
struct PointFit {
    double scale = 1;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector3d> residuals;  ///< scale * rotation * p_i + translation - x_i, metres, one for each point
    double fre = 0;                          ///< fiducial registration error: (weighted) RMS of |residual|, metres

    Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return scale * (rotation * p) + translation; }
};

/// Umeyama (1991), "Least-squares estimation of transformation parameters between two point patterns", IEEE PAMI 13(4),
/// eqs. 40 to 43: with H = sum_i w_i (x_i - mean x)(p_i - mean p)^T = U D V^T, R = U diag(1, 1, det(U V^T)) V^T, and
/// s = tr(D diag(1, 1, det(U V^T))) / sum_i w_i |p_i - mean p|^2. Never a reflection.
/// `from` and `to` have one point each for each fiducial, in the same order; `weights` (not negative) as many, or none.
/// Throws Error for unequal counts, fewer than 3 points (of weight above zero), values that are not finite, and points
/// that coincide or lie on a line, on either side.
PointFit fit_points(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to, Scaling scaling,
                    std::span<const double> weights = {});

/// The same fit by unit quaternions: Horn (1987), "Closed-form solution of absolute orientation using unit
/// quaternions", JOSA A 4(4): the eigenvector of the largest eigenvalue of his 4 x 4 matrix N. Scale as in
/// `fit_points`. An independent check of it; same arguments, same errors.
PointFit fit_points_horn(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to, Scaling scaling,
                         std::span<const double> weights = {});

/// A point-set registration between named frames.
template <class To, class From>
struct Registration {
    SimilarityTransform<To, From> to_from_from;
    std::vector<Eigen::Vector3d> residuals;  ///< in `To`, metres
    double fre = 0;                          ///< metres
};

/// `fit_points` between frames: `register_points<ImageFrame, Tracker>(P, X)` gives image_from_tracker with X_i = s R
/// P_i + t.
template <class To, class From>
Registration<To, From> register_points(std::span<const Eigen::Vector3d> points_in_from,
                                       std::span<const Eigen::Vector3d> points_in_to, Scaling scaling = Scaling::rigid,
                                       std::span<const double> weights = {}) {
    PointFit fit = fit_points(points_in_from, points_in_to, scaling, weights);
    return {{fit.scale, fit.rotation, fit.translation}, std::move(fit.residuals), fit.fre};
}

/// A similarity of scale 1 as a rigid transform: for registrations made with Scaling::rigid.
template <class To, class From>
RigidTransform<To, From> rigid_part(const SimilarityTransform<To, From>& similarity) {
    if (similarity.scale != 1) fail("registration: scale is {}, expected 1 for a rigid transform", similarity.scale);
    return {similarity.rotation, similarity.translation};
}

/// The localisation error (RMS, metres) that explains an FRE: <FRE^2> = (1 - 2/N) <FLE^2> (Sibson 1979; Fitzpatrick,
/// West, Maurer 1998, eq. 10). Throws Error for fewer than 3 fiducials.
double fle_from_fre(double fre, std::size_t fiducials);

/// The target registration error (RMS, metres) to expect at `target` from fiducials at `points` (same frame, metres)
/// that are localised with an isotropic error of RMS length `fle`: Fitzpatrick, West, Maurer (1998), "Predicting error
/// in rigid-body point-based registration", IEEE TMI 17(5), eq. 46:
///     <TRE^2> = <FLE^2> / N (1 + 1/3 sum_k d_k^2 / f_k^2),
/// d_k the target's distance from the fiducials' k-th principal axis, f_k the RMS distance of the fiducials from it.
double expected_tre(std::span<const Eigen::Vector3d> points, double fle, const Eigen::Vector3d& target);

/// For each point the distance (metres) between its target and where the fit of all others puts it: an honest measure
/// of error, where FRE is not. Empty for a point without which the others do not determine a fit; throws Error where
/// `fit_points` would.
std::vector<std::optional<double>> leave_one_out(std::span<const Eigen::Vector3d> from,
                                                 std::span<const Eigen::Vector3d> to, Scaling scaling);

/// Another order of the points that fits clearly better: from[order[i]] belongs to to[i].
struct BetterOrder {
    std::vector<std::size_t> order;
    double fre = 0;        ///< in that order, metres
    double given_fre = 0;  ///< in the order given, metres
};

/// Tries all orders of at most 8 points (rigid fits) when the given order is bad: FRE above `bad_fre` (metres). Returns
/// the best one if its FRE is less than half of the given one's; nothing otherwise, nor for more than 8 points, where
/// trying all would take too long.
std::optional<BetterOrder> better_order(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                                        double bad_fre = 0.003);

}  // namespace livetet
