#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace livetet {

constexpr std::size_t max_ordered_points = 10;

/// Which point is which: from[order[i]] belongs to to[i].
struct PointOrder {
    std::vector<std::size_t> order;
    double fre = 0;  ///< of the rigid fit in that order, metres
};

/// The order that fits best of all there are, and the next best.
struct OrderSearch {
    PointOrder best, rival;
};

/// The orders of the points with the least and second least FRE of a rigid fit: exact, of all N! of
/// 3 to 10 points. Branch and bound: points are assigned one by one, and the residual of the best
/// fit of those assigned (for two of them half the squared difference of their distances) is what
/// no order that begins so can go below. Few beginnings survive: ten points take some 10 ms, ten
/// without any likeness some 100 ms. Throws Error where `fit_points` would, and for more than 10
/// points.
OrderSearch find_order(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to);

/// Whether noise may have made the rival the best: its FRE is below twice the best one's, or below
/// `noise` (metres).
bool is_ambiguous(const OrderSearch& search, double noise = 0.0001);

/// Another order of the points that fits clearly better than the one given, whose FRE is above
/// `bad_fre` (metres): its FRE is less than half. Nothing otherwise, nor for more than 10 points.
struct BetterOrder : PointOrder {
    double given_fre = 0;  ///< in the order given, metres
};
std::optional<BetterOrder> better_order(std::span<const Eigen::Vector3d> from,
                                        std::span<const Eigen::Vector3d> to,
                                        double bad_fre = 0.003);

/// The order other than their own in which points look most like themselves: with its FRE small,
/// their layout is symmetric, and a fit does not tell them apart.
PointOrder nearest_symmetry(std::span<const Eigen::Vector3d> points);

}  // namespace livetet
