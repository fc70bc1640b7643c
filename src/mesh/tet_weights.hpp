#pragma once

#include <algorithm>
#include <array>

#include "mesh/barycentric_map.hpp"

namespace livetet {

/// Barycentric weights of a point in the tet: the negative ones of `weights` are set to 0, and the
/// rest scaled to a sum of 1.
inline std::array<double, 4> inside_weights(std::array<double, 4> weights) {
    double sum = 0;
    for (double& w : weights) sum += w = std::max(w, 0.0);
    for (double& w : weights) w /= sum;
    return weights;
}

/// Barycentric weights on the way from a point of a tet, with weights `near`, to one outside, `at`:
/// as far as none is below min_extrapolated_weight.
inline std::array<double, 4> extrapolated_weights(const std::array<double, 4>& near,
                                                  const std::array<double, 4>& at) {
    double part = 1;
    for (int k = 0; k < 4; ++k)
        if (at[k] < min_extrapolated_weight)
            part = std::min(part, (near[k] - min_extrapolated_weight) / (near[k] - at[k]));
    std::array<double, 4> w{};
    for (int k = 0; k < 4; ++k) w[k] = near[k] + part * (at[k] - near[k]);
    return w;
}

}  // namespace livetet
