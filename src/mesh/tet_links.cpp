#include "mesh/tet_links.hpp"

#include <algorithm>
#include <utility>

#include "base/disjoint_sets.hpp"
#include "base/lists.hpp"
#include "base/sliced_task.hpp"
#include "mesh/node_copies.hpp"

namespace livetet {

namespace {

/// The nodes of the face opposite a corner, rising.
Triangle sorted_face(const Tet& t, int corner) {
    Triangle face{};
    for (int k = 0, to = 0; k < 4; ++k)
        if (k != corner) face[to++] = t[k];
    std::ranges::sort(face);
    return face;
}

}  // namespace

/// Faces by their lowest node: the few at one node are compared with each other.
std::vector<std::array<std::int32_t, 4>> tets_across(std::span<const Tet> tets) {
    std::int32_t node_count = 0;
    for (const Tet& t : tets) node_count = std::max(node_count, *std::ranges::max_element(t) + 1);
    const Lists faces_at = make_lists(node_count, [&](auto&& add) {
        for (std::size_t e = 0; e < tets.size(); ++e)
            for (int k = 0; k < 4; ++k)
                add(sorted_face(tets[e], k)[0], static_cast<std::int32_t>(4 * e + k));
    });
    std::vector<std::array<std::int32_t, 4>> across(tets.size(), {-1, -1, -1, -1});
    std::vector<std::pair<Triangle, std::int32_t>> seen;
    for (std::int32_t n = 0; n < node_count; ++n) {
        pause_point_at(static_cast<std::size_t>(n));
        seen.clear();
        for (const std::int32_t f : faces_at[n]) {
            const Triangle face = sorted_face(tets[f / 4], f % 4);
            const auto other = std::ranges::find_if(seen, [&](const auto& s) {
                return s.first == face && across[s.second / 4][s.second % 4] < 0 &&
                       !std::ranges::is_permutation(tets[s.second / 4], tets[f / 4]);
            });
            if (other == seen.end()) {
                seen.emplace_back(face, f);
                continue;
            }
            across[f / 4][f % 4] = other->second / 4;
            across[other->second / 4][other->second % 4] = f / 4;
        }
    }
    return across;
}

std::vector<TetLink> links_of(std::span<const Tet> tets) {
    const auto across = tets_across(tets);
    std::vector<TetLink> links;
    for (std::size_t e = 0; e < tets.size(); ++e)
        for (const std::int32_t other : across[e])
            if (other > static_cast<std::int32_t>(e))
                links.push_back({static_cast<std::int32_t>(e), other});
    return links;
}

std::vector<std::int32_t> part_nodes(std::vector<Tet>& tets, std::size_t nodes,
                                     std::span<const TetLink> links,
                                     std::span<const std::uint8_t> is_cut) {
    DisjointSets corners(4 * tets.size());
    std::vector<std::uint8_t> is_at_cut(nodes, 0);
    for (std::size_t l = 0; l < links.size(); ++l) {
        const auto [lower, upper] = links[l];
        for (int c = 0; c < 4; ++c) {
            const std::int32_t n = tets[lower][c];
            const auto at = std::ranges::find(tets[upper], n) - tets[upper].begin();
            if (at == 4) continue;
            if (is_cut[l])
                is_at_cut[n] = 1;
            else
                corners.join(4 * lower + c, static_cast<std::int32_t>(4 * upper + at));
        }
    }
    NodeCopies copies(nodes, 4 * tets.size());
    for (std::size_t e = 0; e < tets.size(); ++e)
        for (int c = 0; c < 4; ++c) {
            std::int32_t& n = tets[e][c];
            if (is_at_cut[n])
                n = copies.number(n, corners.find(static_cast<std::int32_t>(4 * e + c)));
        }
    return copies.take_originals();
}

}  // namespace livetet
