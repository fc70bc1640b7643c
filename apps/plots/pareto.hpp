#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace livetet {

/// Indices of the Pareto-optimal points of two figures that should be small, by rising `cost`.
inline std::vector<std::size_t> pareto_front(const std::vector<double>& cost,
                                             const std::vector<double>& error) {
    std::vector<std::size_t> order(cost.size()), front;
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return cost[a] != cost[b] ? cost[a] < cost[b] : error[a] < error[b];
    });
    for (const std::size_t k : order)
        if (front.empty() || error[k] < error[front.back()]) front.push_back(k);
    return front;
}

}  // namespace livetet
