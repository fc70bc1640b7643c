#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <string>

namespace livetet {

/// Two sets of corresponding points, p and x, about their (weighted) means: all that a fit x = s R
/// p + t needs of them.
struct PointMoments {
    Eigen::Vector3d mean_from = Eigen::Vector3d::Zero(), mean_to = Eigen::Vector3d::Zero();
    Eigen::Matrix3d to_from_covariance =
        Eigen::Matrix3d::Zero();  ///< sum_i w_i (x_i - mean x)(p_i - mean p)^T, sum w = 1
    double variance_from = 0, variance_to = 0;  ///< sum_i w_i |p_i - mean p|^2, and of x
};

inline double weight_of(std::span<const double> weights, std::size_t i) {
    return weights.empty() ? 1.0 : weights[i];
}

/// Sum of the weights; where there are none, of one for each of `count` points.
double total_weight(std::span<const double> weights, std::size_t count);

/// How many points have a weight above zero.
std::size_t used_points(std::span<const double> weights, std::size_t count);

/// Throws Error for unequal counts, values that are not finite, weights that are negative or not as
/// many as the points, and fewer than 3 points of weight above zero.
void check_points(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                  std::span<const double> weights);

PointMoments moments_of(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                        std::span<const double> weights);

/// The second largest singular value of the points about their mean, as a share of the largest: 0
/// on a line.
double width_ratio(std::span<const Eigen::Vector3d> points, std::span<const double> weights);

/// What is wrong with the spread of these points, in words: they coincide, or lie on a line. Empty
/// where nothing is.
std::string degeneracy(std::span<const Eigen::Vector3d> points, std::span<const double> weights);

/// `check_points`, then the moments. Throws Error where the points of either side coincide or lie
/// on a line, too.
PointMoments checked_moments(std::span<const Eigen::Vector3d> from,
                             std::span<const Eigen::Vector3d> to, std::span<const double> weights);

/// The most that tr(R^T H) reaches over all rotations: d_0 + d_1 + sign(det H) d_2 with H's
/// singular values d.
double best_trace(const Eigen::Matrix3d& covariance);

}  // namespace livetet
