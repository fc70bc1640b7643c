#pragma once

#include <algorithm>

namespace livetet {

/// Quintic step: 0 for x <= 0, 1 for x >= 1, with zero first and second derivative at both ends.
inline double smooth_step(double x) {
    const double c = std::clamp(x, 0.0, 1.0);
    return c * c * c * (c * (6 * c - 15) + 10);
}

}  // namespace livetet
