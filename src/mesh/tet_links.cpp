#include "mesh/tet_links.hpp"

#include <algorithm>
#include <utility>

#include "base/disjoint_sets.hpp"
#include "mesh/node_copies.hpp"
#include "mesh/tet_faces.hpp"

namespace livetet {

std::vector<TetLink> links_of(std::span<const Tet> tets) {
    std::vector<std::pair<Triangle, std::int32_t>> faces;
    faces.reserve(4 * tets.size());
    for (std::size_t e = 0; e < tets.size(); ++e)
        for (const auto& [a, b, c] : tet_faces) {
            Triangle face{tets[e][a], tets[e][b], tets[e][c]};
            std::ranges::sort(face);
            faces.emplace_back(face, static_cast<std::int32_t>(e));
        }
    std::ranges::sort(faces);
    std::vector<TetLink> links;
    for (std::size_t f = 1; f < faces.size(); ++f)
        if (faces[f - 1].first == faces[f].first &&
            !std::ranges::is_permutation(tets[faces[f - 1].second], tets[faces[f].second]))
            links.push_back({faces[f - 1].second, faces[f].second});
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
