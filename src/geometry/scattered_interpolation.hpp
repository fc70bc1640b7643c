#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace livetet {

/// Interpolates values of scattered places at other points by the weights of Franke and Little:
/// with d_k the distances of a point from its 4 nearest places and d_5 that of the next one, place
/// k weighs
///
///     (1 / d_k - 1 / d_5)^2,
///
/// divided by the sum. Weights are not negative and sum to 1, so interpolated values lie between
/// those of the places. They are continuous in the point, except where five places are equally
/// far: a place loses its weight before another takes its turn. At a place the value is that
/// place's. Distances are straight: the places behind a thin sheet weigh, too.
class ScatteredInterpolation {
  public:
    /// `places` and `points`: in one unit. Computes the weights; takes
    /// O(places.size() * points.size()). Throws Error if there is no place.
    ScatteredInterpolation(std::span<const Eigen::Vector3d> places,
                           std::span<const Eigen::Vector3d> points);

    std::size_t size() const { return weights_.size(); }
    /// The value at one point; `values`: one for each place.
    double operator()(std::size_t point, std::span<const double> values) const;

  private:
    static constexpr int count = 4;
    std::vector<std::array<std::int32_t, count>> nearest_;
    std::vector<std::array<double, count>> weights_;
};

}  // namespace livetet
