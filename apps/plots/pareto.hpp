#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace livetet {

/// The points that no other is better than in one and at least as good as in the other of two
/// figures, of both of which less is better: their numbers, by rising `cost`.
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
