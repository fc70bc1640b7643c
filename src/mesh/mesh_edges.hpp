#pragma once

#include <algorithm>
#include <cstdint>

#include "base/lists.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The edge between two nodes as one number, whatever their order; rising with the lower one.
inline std::uint64_t edge_key(std::int32_t a, std::int32_t b) {
    return static_cast<std::uint64_t>(std::min(a, b)) << 32 |
           static_cast<std::uint32_t>(std::max(a, b));
}

/// The edges of tets with nodes 0 to nodes - 1, by their lower ends: list n has the nodes above n
/// that an edge joins it to, rising. An edge's number is its place among the items of all lists.
Lists edges_by_lower_end(std::span<const Tet> tets, std::size_t nodes);

/// Number of the edge between two nodes; -1 if there is none.
std::int32_t edge_between(const Lists& edges, std::int32_t a, std::int32_t b);

}  // namespace livetet
