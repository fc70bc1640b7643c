#include "geometry/point_moments.hpp"

#include <Eigen/Dense>

#include <cmath>
#include <numeric>

#include "base/error.hpp"

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Points = std::span<const Vector3d>;

constexpr double min_spread = 1e-6;  // metres; points closer together coincide
// Ratio of the second to the first singular value; below it points lie on a line.
constexpr double min_ratio = 0.01;

Vector3d mean_of(Points points, std::span<const double> weights) {
    Vector3d sum = Vector3d::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) sum += weight_of(weights, i) * points[i];
    return sum / total_weight(weights, points.size());
}

// RMS distance from the mean along each principal axis, ascending.
Vector3d principal_spread(Points points, std::span<const double> weights) {
    const Vector3d mean = mean_of(points, weights);
    Matrix3d scatter = Matrix3d::Zero();
    for (std::size_t i = 0; i < points.size(); ++i)
        scatter += weight_of(weights, i) * (points[i] - mean) * (points[i] - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(
        scatter / total_weight(weights, points.size()), Eigen::EigenvaluesOnly);
    return eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
}

}  // namespace

double total_weight(std::span<const double> weights, std::size_t count) {
    return weights.empty() ? static_cast<double>(count)
                           : std::accumulate(weights.begin(), weights.end(), 0.0);
}

std::size_t used_points(std::span<const double> weights, std::size_t count) {
    std::size_t used = 0;
    for (std::size_t i = 0; i < count; ++i) used += weight_of(weights, i) > 0;
    return used;
}

void check_points(Points from, Points to, std::span<const double> weights) {
    if (from.size() != to.size())
        fail("registration: {} points to move and {} to move them to, expected equal numbers",
             from.size(), to.size());
    if (!weights.empty() && weights.size() != from.size())
        fail("registration: {} weights for {} points, expected one each", weights.size(),
             from.size());
    for (std::size_t i = 0; i < from.size(); ++i) {
        if (!from[i].allFinite() || !to[i].allFinite())
            fail("registration: point {} of {} has a coordinate that is not finite", i + 1,
                 from.size());
        const double w = weight_of(weights, i);
        if (!std::isfinite(w) || w < 0)
            fail("registration: weight {} is {}, expected a finite number that is not negative",
                 i + 1, w);
    }
    const std::size_t used = used_points(weights, from.size());
    if (used < 3)
        fail("registration: {} points{}, expected at least 3", used,
             weights.empty() ? "" : " of some weight");
}

PointMoments moments_of(Points from, Points to, std::span<const double> weights) {
    PointMoments m;
    const double total = total_weight(weights, from.size());
    m.mean_from = mean_of(from, weights);
    m.mean_to = mean_of(to, weights);
    for (std::size_t i = 0; i < from.size(); ++i) {
        const double w = weight_of(weights, i) / total;
        const Vector3d p = from[i] - m.mean_from, x = to[i] - m.mean_to;
        m.to_from_covariance += w * x * p.transpose();
        m.variance_from += w * p.squaredNorm();
        m.variance_to += w * x.squaredNorm();
    }
    return m;
}

double width_ratio(Points points, std::span<const double> weights) {
    const Vector3d spread = principal_spread(points, weights);
    return spread[2] > 0 ? spread[1] / spread[2] : 0;
}

std::string degeneracy(Points points, std::span<const double> weights) {
    const Vector3d spread = principal_spread(points, weights);
    if (spread[2] < min_spread)
        return fmt::format("coincide (RMS spread {:.3g} mm, expected at least {} mm)",
                           1e3 * spread[2], 1e3 * min_spread);
    if (spread[1] < min_ratio * spread[2])
        return fmt::format(
            "lie on a line (singular values {:.4g} and {:.4g} mm, ratio {:.2g}, expected at least "
            "{})",
            1e3 * spread[2], 1e3 * spread[1], spread[1] / spread[2], min_ratio);
    return {};
}

PointMoments checked_moments(Points from, Points to, std::span<const double> weights) {
    check_points(from, to, weights);
    if (const std::string text = degeneracy(from, weights); !text.empty())
        fail("registration: the {} points to move {}", from.size(), text);
    if (const std::string text = degeneracy(to, weights); !text.empty())
        fail("registration: the {} points to move to {}", to.size(), text);
    return moments_of(from, to, weights);
}

double best_trace(const Matrix3d& covariance) {
    const Vector3d d = Eigen::JacobiSVD<Matrix3d>(covariance).singularValues();
    return d[0] + d[1] + (covariance.determinant() < 0 ? -d[2] : d[2]);
}

}  // namespace livetet
