#pragma once

#include <limits>
#include <string>

namespace livetet {

/// Which ends of an interval belong to it.
enum class Ends { included, excluded, low_excluded };

/// Interval of numbers, unlimited by default. An infinite bound limits nothing.
struct Interval {
    double low = -std::numeric_limits<double>::infinity();
    double high = std::numeric_limits<double>::infinity();
    Ends ends = Ends::included;

    bool has_low() const { return low > -std::numeric_limits<double>::infinity(); }
    bool has_high() const { return high < std::numeric_limits<double>::infinity(); }
    bool includes_low() const { return ends == Ends::included; }
    bool includes_high() const { return ends != Ends::excluded; }

    /// False for NaN.
    bool contains(double x) const {
        return (includes_low() ? x >= low : x > low) && (includes_high() ? x <= high : x < high);
    }
    /// Completes "must be ...": "from 0 to 1", "above 0 and at most 1", "greater than 0". Empty
    /// without a bound.
    std::string text() const;
};

}  // namespace livetet
