#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "base/disjoint_sets.hpp"

namespace livetet {

/// Which pairs of neighbours are cut: one entry a link. Links are of any kind with `lower` and
/// `upper`, the cells that they join.
struct LinkCuts {
    std::vector<std::uint8_t> cut, kept;

    explicit LinkCuts(std::size_t links) : cut(links, 0), kept(cut) {}
    void keep() { kept = cut; }
    void undo() { cut = kept; }
    std::size_t parted() const { return static_cast<std::size_t>(std::ranges::count(kept, 1)); }

    /// Restores links, of those that were cut since the last `keep`, so that pieces of fewer than
    /// `min_cells` hang together with a larger one; where there is none, with another small one.
    template <class Link>
    void rejoin_small_pieces(const std::vector<Link>& links, std::size_t cells, int min_cells) {
        DisjointSets pieces(cells);
        for (std::size_t l = 0; l < cut.size(); ++l)
            if (!cut[l]) pieces.join(links[l].lower, links[l].upper);
        std::vector<int> size(cells, 0);
        for (std::size_t c = 0; c < cells; ++c) ++size[pieces.find(static_cast<std::int32_t>(c))];
        const auto rejoin = [&](bool among_small) {
            bool is_any = false;
            for (std::size_t l = 0; l < cut.size(); ++l) {
                if (!cut[l] || kept[l]) continue;
                const auto a = pieces.find(links[l].lower), b = pieces.find(links[l].upper);
                if (a == b || std::min(size[a], size[b]) >= min_cells) continue;
                if (!among_small && std::max(size[a], size[b]) < min_cells) continue;
                cut[l] = 0;
                pieces.join(a, b);
                size[pieces.find(a)] = size[a] + size[b];
                is_any = true;
            }
            return is_any;
        };
        while (rejoin(false)) {
        }
        rejoin(true);
    }
};

}  // namespace livetet
