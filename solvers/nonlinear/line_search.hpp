#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

namespace livetet {

/// A line search tries at most this many lengths and takes the last as it is.
constexpr int max_line_search_trials = 7;

/// The backtracking rule of Newton's line search. `slope` is r . d, minus the slope of the energy
/// along the direction d; `norm` is |r|; both before the step and after one of `length` times d. A
/// length is good if the energy does not rise at its end more than 0.9 times as steeply as it fell
/// before, or if |r| has halved. If the slope before is not positive, |r| alone decides. Returns
/// nothing if the length is good, else the next length to try.
inline std::optional<double> next_length(double slope_before, double slope_after,
                                         double norm_before, double norm_after, double length) {
    const bool is_good =
        slope_before <= 0 ? norm_after <= (1 - 1e-4 * length) * norm_before
                          : slope_after >= -0.9 * slope_before || norm_after <= 0.5 * norm_before;
    if (is_good && std::isfinite(norm_after)) return std::nullopt;
    const double root = slope_before > 0 && std::isfinite(slope_after)
                            ? slope_before / (slope_before - slope_after)
                            : 0.5;
    return length * std::clamp(root, 0.1, 0.5);
}

}  // namespace livetet
