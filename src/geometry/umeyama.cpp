#include "geometry/umeyama.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Points = std::span<const Vector3d>;

constexpr double min_spread = 1e-6;  // metres: closer together than this, points coincide
constexpr double min_ratio = 0.01;   // second to first singular value: below this, points lie on a line
constexpr std::size_t max_searched = 8;

double weight(std::span<const double> weights, std::size_t i) { return weights.empty() ? 1.0 : weights[i]; }

// What is wrong with the spread of these points, in words; empty where nothing is.
std::string degeneracy(Points points, std::span<const double> weights, const Vector3d& mean) {
    Matrix3d scatter = Matrix3d::Zero();
    double total = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vector3d d = points[i] - mean;
        scatter += weight(weights, i) * d * d.transpose();
        total += weight(weights, i);
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(scatter / total, Eigen::EigenvaluesOnly);
    const Vector3d spread = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();  // ascending, RMS along each principal axis
    if (spread[2] < min_spread)
        return fmt::format("coincide (RMS spread {:.3g} mm, expected at least {} mm)", 1e3 * spread[2],
                           1e3 * min_spread);
    if (spread[1] < min_ratio * spread[2])
        return fmt::format("lie on a line (singular values {:.4g} and {:.4g} mm, ratio {:.2g}, expected at least {})",
                           1e3 * spread[2], 1e3 * spread[1], spread[1] / spread[2], min_ratio);
    return {};
}

// The two point sets about their means, and what both methods need of them.
struct Centred {
    Vector3d mean_from = Vector3d::Zero(), mean_to = Vector3d::Zero();
    Matrix3d to_from_covariance = Matrix3d::Zero();  // sum_i w_i (x_i - mean x)(p_i - mean p)^T, sum w = 1
    double variance_from = 0, variance_to = 0;
};

void check_arguments(Points from, Points to, std::span<const double> weights) {
    if (from.size() != to.size())
        fail("registration: {} points to move and {} to move them to, expected as many", from.size(), to.size());
    if (!weights.empty() && weights.size() != from.size())
        fail("registration: {} weights for {} points, expected one each", weights.size(), from.size());
    std::size_t used = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
        if (!from[i].allFinite() || !to[i].allFinite())
            fail("registration: point {} of {} is not at a finite place", i + 1, from.size());
        const double w = weight(weights, i);
        if (!std::isfinite(w) || w < 0)
            fail("registration: weight {} is {}, expected a finite number that is not negative", i + 1, w);
        used += w > 0;
    }
    if (used < 3)
        fail("registration: {} points{}, expected at least 3", used, weights.empty() ? "" : " of some weight");
}

Centred centred(Points from, Points to, std::span<const double> weights) {
    Centred c;
    double total = 0;
    for (std::size_t i = 0; i < from.size(); ++i) total += weight(weights, i);
    for (std::size_t i = 0; i < from.size(); ++i) {
        c.mean_from += weight(weights, i) / total * from[i];
        c.mean_to += weight(weights, i) / total * to[i];
    }
    for (std::size_t i = 0; i < from.size(); ++i) {
        const double w = weight(weights, i) / total;
        const Vector3d p = from[i] - c.mean_from, x = to[i] - c.mean_to;
        c.to_from_covariance += w * x * p.transpose();
        c.variance_from += w * p.squaredNorm();
        c.variance_to += w * x.squaredNorm();
    }
    return c;
}

Centred checked_and_centred(Points from, Points to, std::span<const double> weights) {
    check_arguments(from, to, weights);
    const Centred c = centred(from, to, weights);
    if (const std::string text = degeneracy(from, weights, c.mean_from); !text.empty())
        fail("registration: the {} points to move {}", from.size(), text);
    if (const std::string text = degeneracy(to, weights, c.mean_to); !text.empty())
        fail("registration: the {} points to move to {}", to.size(), text);
    return c;
}

// The fit that has this rotation: scale, translation, residuals.
PointFit complete(const Centred& c, const Matrix3d& rotation, Scaling scaling, Points from, Points to,
                  std::span<const double> weights) {
    PointFit fit;
    fit.rotation = rotation;
    if (scaling == Scaling::similarity)
        fit.scale = (rotation.transpose() * c.to_from_covariance).trace() / c.variance_from;
    fit.translation = c.mean_to - fit.scale * (rotation * c.mean_from);
    double sum = 0, total = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
        fit.residuals.push_back(fit * from[i] - to[i]);
        sum += weight(weights, i) * fit.residuals.back().squaredNorm();
        total += weight(weights, i);
    }
    fit.fre = std::sqrt(sum / total);
    return fit;
}

// FRE of the best rigid fit without making the fit: variance_from + variance_to - 2 tr(D S).
double rigid_fre(const Centred& c) {
    const Vector3d d = Eigen::JacobiSVD<Matrix3d>(c.to_from_covariance).singularValues();
    const double last = c.to_from_covariance.determinant() < 0 ? -d[2] : d[2];
    return std::sqrt(std::max(0.0, c.variance_from + c.variance_to - 2 * (d[0] + d[1] + last)));
}

}  // namespace

PointFit fit_points(Points from, Points to, Scaling scaling, std::span<const double> weights) {
    const Centred c = checked_and_centred(from, to, weights);
    return complete(c, nearest_rotation(c.to_from_covariance), scaling, from, to, weights);
}

PointFit fit_points_horn(Points from, Points to, Scaling scaling, std::span<const double> weights) {
    const Centred c = checked_and_centred(from, to, weights);
    const Matrix3d S = c.to_from_covariance.transpose();  // Horn's S_ab = sum p_a x_b
    const Vector3d z(S(1, 2) - S(2, 1), S(2, 0) - S(0, 2), S(0, 1) - S(1, 0));
    Eigen::Matrix4d N;
    N(0, 0) = S.trace();
    N.block<3, 1>(1, 0) = z;
    N.block<1, 3>(0, 1) = z.transpose();
    N.block<3, 3>(1, 1) = S + S.transpose() - S.trace() * Matrix3d::Identity();
    const Eigen::Vector4d q = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(N).eigenvectors().col(3);
    const Matrix3d rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    return complete(c, rotation, scaling, from, to, weights);
}

double fle_from_fre(double fre, std::size_t fiducials) {
    if (fiducials < 3) fail("localisation error from FRE: {} fiducials, expected at least 3", fiducials);
    return fre / std::sqrt(1 - 2.0 / static_cast<double>(fiducials));
}

double expected_tre(Points points, double fle, const Vector3d& target) {
    check_arguments(points, points, {});
    const auto count = static_cast<double>(points.size());
    const Vector3d mean = std::accumulate(points.begin(), points.end(), Vector3d(Vector3d::Zero())) / count;
    if (const std::string text = degeneracy(points, {}, mean); !text.empty())
        fail("expected error: the {} fiducials {}", points.size(), text);
    Matrix3d scatter = Matrix3d::Zero();
    for (const Vector3d& p : points) scatter += (p - mean) * (p - mean).transpose() / count;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(scatter);
    const Vector3d d = eigen.eigenvectors().transpose() * (target - mean);
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        const double d2 = d.squaredNorm() - d[k] * d[k];
        const double f2 = eigen.eigenvalues().sum() - eigen.eigenvalues()[k];
        sum += d2 / f2;
    }
    return fle * std::sqrt((1 + sum / 3) / count);
}

std::vector<std::optional<double>> leave_one_out(Points from, Points to, Scaling scaling) {
    checked_and_centred(from, to, {});
    std::vector<std::optional<double>> errors(from.size());
    if (from.size() < 4) return errors;
    std::vector<double> others(from.size(), 1.0);
    for (std::size_t i = 0; i < from.size(); ++i) {
        others[i] = 0;
        const Centred c = centred(from, to, others);
        if (degeneracy(from, others, c.mean_from).empty() && degeneracy(to, others, c.mean_to).empty())
            errors[i] = (fit_points(from, to, scaling, others) * from[i] - to[i]).norm();
        others[i] = 1;
    }
    return errors;
}

std::optional<BetterOrder> better_order(Points from, Points to, double bad_fre) {
    const double given_fre = rigid_fre(checked_and_centred(from, to, {}));
    if (from.size() > max_searched || given_fre <= bad_fre) return std::nullopt;
    std::vector<std::size_t> order(from.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    BetterOrder best{order, given_fre, given_fre};
    std::vector<Vector3d> permuted(from.size());
    while (std::next_permutation(order.begin(), order.end())) {
        for (std::size_t i = 0; i < order.size(); ++i) permuted[i] = from[order[i]];
        if (const double fre = rigid_fre(centred(permuted, to, {})); fre < best.fre) {
            best.order = order;
            best.fre = fre;
        }
    }
    if (best.fre >= given_fre / 2) return std::nullopt;
    return best;
}

}  // namespace livetet
