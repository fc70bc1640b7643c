#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <string>

namespace livetet {

/// First and second moments of corresponding points p_i (from) and x_i (to), with weights w_i
/// normalised to sum w = 1. They determine the fit x = s R p + t.
struct PointMoments {
    Eigen::Vector3d mean_from = Eigen::Vector3d::Zero(), mean_to = Eigen::Vector3d::Zero();
    /// sum_i w_i (x_i - mean x)(p_i - mean p)^T
    Eigen::Matrix3d to_from_covariance = Eigen::Matrix3d::Zero();
    double variance_from = 0,
           variance_to = 0;  ///< sum_i w_i |p_i - mean p|^2 and sum_i w_i |x_i - mean x|^2
};

/// Weight of point i; 1 if there are no weights.
inline double weight_of(std::span<const double> weights, std::size_t i) {
    return weights.empty() ? 1.0 : weights[i];
}

/// Sum of the weights, or `count` if there are none.
double total_weight(std::span<const double> weights, std::size_t count);

/// Number of points with a weight above zero.
std::size_t used_points(std::span<const double> weights, std::size_t count);

/// Throws Error if the counts of points and weights differ, if a value is not finite, if a weight
/// is negative, or if fewer than 3 points have a weight above zero.
void check_points(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                  std::span<const double> weights);

/// The moments of valid points (see `check_points`). `weights` need not be normalised.
PointMoments moments_of(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                        std::span<const double> weights);

/// Ratio of the second largest to the largest singular value of the centred points; 0 if they lie
/// on a line.
double width_ratio(std::span<const Eigen::Vector3d> points, std::span<const double> weights);

/// Says, for a message, that the points coincide or lie on a line; empty if they do neither.
std::string degeneracy(std::span<const Eigen::Vector3d> points, std::span<const double> weights);

/// `check_points`, then `moments_of`. Also throws Error if the points of either side coincide or
/// lie on a line.
PointMoments checked_moments(std::span<const Eigen::Vector3d> from,
                             std::span<const Eigen::Vector3d> to, std::span<const double> weights);

/// Maximum of tr(R^T H) over all rotations R: d_0 + d_1 + sign(det H) d_2, with d the singular
/// values of H in descending order.
double best_trace(const Eigen::Matrix3d& covariance);

}  // namespace livetet
