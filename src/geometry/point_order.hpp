#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace livetet {

constexpr std::size_t max_ordered_points = 10;

/// A correspondence: from[order[i]] belongs to to[i].
struct PointOrder {
    std::vector<std::size_t> order;
    double fre = 0;  ///< FRE of the rigid fit in that order, metres
};

/// The orders with the smallest and the second smallest FRE.
struct OrderSearch {
    PointOrder best, rival;
};

/// Finds, among all N! orders of 3 to 10 points, the two with the smallest fiducial registration
/// error (FRE) of a rigid fit. The search is exact: branch and bound that assigns one point at a
/// time. The lower bound of a partial assignment is the residual of its best fit; for two points
/// that is half the squared difference of their distances. Ten points take about 10 ms, and ten
/// points that do not match at all about 100 ms. Throws Error as `fit_points` does, and for more
/// than 10 points.
OrderSearch find_order(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to);

/// Whether noise could have swapped the best order and the rival: the rival's FRE is below twice
/// the best one's or below `noise` (metres).
bool is_ambiguous(const OrderSearch& search, double noise = 0.0001);

/// An order that fits clearly better than the given one.
struct BetterOrder : PointOrder {
    double given_fre = 0;  ///< FRE in the given order, metres
};
/// The best order, if the given order has an FRE above `bad_fre` (metres) and the best one less
/// than half of that. Nothing otherwise, and nothing for more than 10 points.
std::optional<BetterOrder> better_order(std::span<const Eigen::Vector3d> from,
                                        std::span<const Eigen::Vector3d> to,
                                        double bad_fre = 0.003);

/// The order, other than the identity, in which the points match themselves best. If its FRE is
/// small, their layout is symmetric and a fit cannot tell the points apart.
PointOrder nearest_symmetry(std::span<const Eigen::Vector3d> points);

}  // namespace livetet
