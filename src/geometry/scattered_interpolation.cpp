#include "geometry/scattered_interpolation.hpp"

#include <algorithm>
#include <limits>

#include "base/error.hpp"

namespace livetet {

ScatteredInterpolation::ScatteredInterpolation(std::span<const Eigen::Vector3d> places,
                                               std::span<const Eigen::Vector3d> points) {
    if (places.empty()) fail("interpolation between no places, expected at least one");
    struct Near {
        double distance = std::numeric_limits<double>::infinity();
        std::int32_t place = 0;
    };
    for (const Eigen::Vector3d& x : points) {
        std::array<Near, count + 1> near{};  // sorted by distance
        for (std::size_t p = 0; p < places.size(); ++p) {
            Near next{(places[p] - x).norm(), static_cast<std::int32_t>(p)};
            for (Near& n : near)
                if (next.distance < n.distance) std::swap(next, n);
        }
        auto& nearest = nearest_.emplace_back();
        auto& weights = weights_.emplace_back();
        // Scaled by d_1^2, which leaves 1 for the nearest place and lets its distance be 0.
        const double first = near[0].distance, beyond = first / near[count].distance;
        double sum = 0;
        for (int k = 0; k < count; ++k) {
            nearest[k] = near[k].place;
            const double share = near[k].distance > 0 ? first / near[k].distance : 1;
            weights[k] = (share - beyond) * (share - beyond);
            sum += weights[k];
        }
        if (!(sum > 0)) {  // the fifth is no farther
            weights.fill(1);
            sum = count;
        }
        for (double& weight : weights) weight /= sum;
    }
}

double ScatteredInterpolation::operator()(std::size_t point, std::span<const double> values) const {
    double value = 0;
    for (int k = 0; k < count; ++k) value += weights_[point][k] * values[nearest_[point][k]];
    return value;
}

}  // namespace livetet
