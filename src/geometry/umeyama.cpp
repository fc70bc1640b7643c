#include "geometry/umeyama.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "geometry/point_moments.hpp"

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Points = std::span<const Vector3d>;

constexpr double rounding =
    1e-8;  // relative to the points' spread: allowed difference of two exact methods

// Completes a fit of given rotation: scale, translation, residuals.
PointFit complete(const PointMoments& m, const Matrix3d& rotation, Scaling scaling, Points from,
                  Points to, std::span<const double> weights) {
    PointFit fit;
    fit.rotation = rotation;
    if (scaling == Scaling::similarity)
        fit.scale = (rotation.transpose() * m.to_from_covariance).trace() / m.variance_from;
    fit.translation = m.mean_to - fit.scale * (rotation * m.mean_from);
    double sum = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
        fit.residuals.push_back(fit * from[i] - to[i]);
        sum += weight_of(weights, i) * fit.residuals.back().squaredNorm();
    }
    fit.fre = std::sqrt(sum / total_weight(weights, from.size()));
    return fit;
}

}  // namespace

PointFit fit_points(Points from, Points to, Scaling scaling, std::span<const double> weights) {
    const PointMoments m = checked_moments(from, to, weights);
    return complete(m, nearest_rotation(m.to_from_covariance), scaling, from, to, weights);
}

// The unit quaternion that maximises q^T N q gives the rotation that maximises tr(R^T H).
PointFit fit_points_horn(Points from, Points to, Scaling scaling, std::span<const double> weights) {
    const PointMoments m = checked_moments(from, to, weights);
    const Matrix3d S = m.to_from_covariance.transpose();  // Horn's S_ab = sum p_a x_b
    const Vector3d z(S(1, 2) - S(2, 1), S(2, 0) - S(0, 2), S(0, 1) - S(1, 0));
    Eigen::Matrix4d N;
    N(0, 0) = S.trace();
    N.block<3, 1>(1, 0) = z;
    N.block<1, 3>(0, 1) = z.transpose();
    N.block<3, 3>(1, 1) = S + S.transpose() - S.trace() * Matrix3d::Identity();
    const Eigen::Vector4d q =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(N).eigenvectors().col(3);
    const Matrix3d rotation =
        Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    return complete(m, rotation, scaling, from, to, weights);
}

void check_agreement(const PointFit& a, const PointFit& b, Points from, Points to) {
    double apart = 0, spread = 0;
    for (const Vector3d& p : from) apart = std::max(apart, (a * p - b * p).norm());
    for (const Vector3d& x : to) spread = std::max(spread, (x - to.front()).norm());
    if (apart <= rounding * spread) return;
    if (std::abs(a.fre - b.fre) <= rounding * spread)
        fail(
            "registration: two rotations fit equally well, FRE {:.3f} mm, and put a point {:.3g} "
            "mm apart: expected points that have one best rotation (are they in the right order, "
            "and not mirrored?)",
            1e3 * a.fre, 1e3 * apart);
    fail(
        "registration: Umeyama's fit and Horn's put a point {:.3g} mm apart (FRE {:.6f} and {:.6f} "
        "mm), expected at most {:.1g} mm",
        1e3 * apart, 1e3 * a.fre, 1e3 * b.fre, 1e3 * rounding * spread);
}

PointFit fit_points_cross_checked(Points from, Points to, Scaling scaling,
                                  std::span<const double> weights) {
    PointFit fit = fit_points(from, to, scaling, weights);
    check_agreement(fit, fit_points_horn(from, to, scaling, weights), from, to);
    return fit;
}

}  // namespace livetet
