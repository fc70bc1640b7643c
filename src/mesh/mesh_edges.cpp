#include "mesh/mesh_edges.hpp"

#include <algorithm>

namespace livetet {

Lists edges_by_lower_end(std::span<const Tet> tets, std::size_t nodes) {
    Lists edges = make_lists(nodes, [&](auto&& add) {
        for (const Tet& t : tets)
            for (const auto& [i, j] : tet_edges)
                add(static_cast<std::size_t>(std::min(t[i], t[j])), std::max(t[i], t[j]));
    });
    sort_and_unique(edges);
    return edges;
}

std::int32_t edge_between(const Lists& edges, std::int32_t a, std::int32_t b) {
    const auto upper = edges[static_cast<std::size_t>(std::min(a, b))];
    const auto found = std::ranges::lower_bound(upper, std::max(a, b));
    if (found == upper.end() || *found != std::max(a, b)) return -1;
    return edges.start[std::min(a, b)] + static_cast<std::int32_t>(found - upper.begin());
}

}  // namespace livetet
