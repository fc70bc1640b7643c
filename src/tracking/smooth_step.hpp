#pragma once

#include <algorithm>

namespace livetet {

/// 0 before 0, 1 after 1, with no velocity and no acceleration at either end.
inline double smooth_step(double x) {
    const double c = std::clamp(x, 0.0, 1.0);
    return c * c * c * (c * (6 * c - 15) + 10);
}

}  // namespace livetet
