#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Two tets that share a face.
struct TetLink {
    std::int32_t lower = 0, upper = 0;
};

/// The tet behind the face opposite each corner of each tet; -1 on the boundary. Of more than two
/// tets at a face the first two that differ in a node. O(n).
std::vector<std::array<std::int32_t, 4>> tets_across(std::span<const Tet> tets);

/// The links of tets, by their faces' nodes; none between tets of the same four nodes. O(n).
std::vector<TetLink> links_of(std::span<const Tet> tets);

/// Doubles the nodes of open faces around which links that are not cut no longer join all tets: the
/// first of these keeps a node's number, the copies that others take follow after all nodes, so far
/// `nodes`. `is_cut`: one entry a link. Returns of each copy the node that it is one of.
std::vector<std::int32_t> part_nodes(std::vector<Tet>& tets, std::size_t nodes,
                                     std::span<const TetLink> links,
                                     std::span<const std::uint8_t> is_cut);

}  // namespace livetet
