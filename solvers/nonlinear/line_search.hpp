#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

namespace livetet {

/// A line search tries at most this many lengths and takes the last as it is.
constexpr int max_line_search_trials = 7;

/// The backtracking rule of Newton's line search. Along a direction d the energy's slope is -r . d:
/// a step is long enough, and not too long, where the slope has come near zero. `slope` is r . d,
/// `norm` that of r, before the step and after one of `length` times d. Where the slope before says
/// nothing (it is not positive), the norm decides. Empty where the length is good, else the next
/// one to try.
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
