#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include "mesh/barycentric_map.hpp"

// Vectors of nodes in single precision, three numbers a node and one behind the last, and their
// transfer between the levels of a hierarchy.

namespace livetet {

using FourFloats [[gnu::vector_size(16)]] = float;

inline FourFloats load_node(const float* p) {
    FourFloats v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

/// The first three lanes.
inline void store_node(FourFloats v, float* p) {
    std::memcpy(p, &v, 2 * sizeof(float));
    p[2] = v[2];
}

/// The transpose of an interpolation: coarse node n has the weight `weights[k]` in fine node
/// `nodes[k]`, for k from start[n] to start[n + 1].
struct TransposedMap {
    std::vector<std::int32_t> start, nodes;
    std::vector<float> weights;

    TransposedMap(const BarycentricMap& map, std::size_t coarse_nodes)
        : TransposedMap(coarse_nodes, [&](const auto& visit) {
              for (std::size_t i = 0; i < map.size(); ++i)
                  for (int k = 0; k < 4; ++k) visit(i, map.nodes[i][k], map.weights[i][k]);
          }) {}
    /// `visit_all(visit)` calls visit(fine node, coarse node, weight) for all entries, each time in
    /// the same order.
    template <class VisitAll>
    TransposedMap(std::size_t coarse_nodes, const VisitAll& visit_all)
        : start(coarse_nodes + 1, 0) {
        visit_all([&](std::size_t, std::int32_t n, double) { ++start[n + 1]; });
        for (std::size_t n = 0; n < coarse_nodes; ++n) start[n + 1] += start[n];
        nodes.resize(start.back());
        weights.resize(start.back());
        std::vector<std::int32_t> next(start.begin(), start.end() - 1);
        visit_all([&](std::size_t fine, std::int32_t n, double weight) {
            const std::int32_t place = next[n]++;
            nodes[place] = static_cast<std::int32_t>(fine);
            weights[place] = static_cast<float>(weight);
        });
    }
    /// The weighted sum of the fine nodes' values around coarse node n.
    FourFloats gather(std::size_t n, const float* fine) const {
        FourFloats sum{};
        for (std::int32_t k = start[n]; k < start[n + 1]; ++k)
            sum += weights[k] * load_node(fine + 3 * nodes[k]);
        return sum;
    }
    /// Their weighted mean; negative weights count as 0.
    FourFloats mean(std::size_t n, const float* fine) const {
        FourFloats sum{};
        float total = 1e-6F;
        for (std::int32_t k = start[n]; k < start[n + 1]; ++k) {
            const float w = std::max(weights[k], 0.0F);
            sum += w * load_node(fine + 3 * nodes[k]);
            total += w;
        }
        return sum / total;
    }
};

}  // namespace livetet
