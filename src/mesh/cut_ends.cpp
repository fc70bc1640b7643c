#include "mesh/cut_ends.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>

#include "base/disjoint_sets.hpp"
#include "base/lists.hpp"

namespace livetet {

namespace {

/// The section through a coarse cell, or the face between two: a link of `parents`. `lower` is
/// `upper` inside a cell.
using Section = HexLink;

class CutEnds {
  public:
    explicit CutEnds(const HexLevel& fine) : fine_(fine), octants_(find_octants(fine)) {
        find_half_cut();
        if (sections_.empty()) return;
        links_ = make_lists(6 * fine.places.size(), [&](auto&& add) {
            for (const HexLink& link : fine.links) {
                add(row_of(link.lower, link.axis, true), link.upper);
                add(row_of(link.upper, link.axis, false), link.lower);
            }
        });
        keep_those_joined_beside();
    }

    /// Whether the link is one of a section to be opened.
    bool opens(const HexLink& link) const {
        return std::binary_search(sections_.begin(), sections_.end(), section_of(link));
    }

  private:
    /// Of each coarse cell: bit o is set if it has a cell at octant o.
    static std::vector<std::uint8_t> find_octants(const HexLevel& fine) {
        std::vector<std::uint8_t> octants(1 + *std::ranges::max_element(fine.parents), 0);
        for (std::size_t e = 0; e < fine.places.size(); ++e)
            octants[fine.parents[e]] |= static_cast<std::uint8_t>(1 << octant_of(fine.places[e]));
        return octants;
    }

    static std::size_t row_of(std::int32_t cell, int axis, bool upwards) {
        return 6 * static_cast<std::size_t>(cell) + 2 * axis + (upwards ? 1 : 0);
    }

    Section section_of(const HexLink& link) const {
        return {fine_.parents[link.lower], fine_.parents[link.upper], link.axis};
    }

    /// How many links the section would have without cuts.
    std::ptrdiff_t whole_width(const Section& s) const {
        const int first = s.lower == s.upper ? 0 : 1;  // of the lower cells' octants along the axis
        std::ptrdiff_t width = 0;
        for (int o = 0; o < 8; ++o)
            width += (o >> s.axis & 1) == first && (octants_[s.lower] >> o & 1) &&
                     (octants_[s.upper] >> (o ^ 1 << s.axis) & 1);
        return width;
    }

    void find_half_cut() {
        std::vector<Section> of_links;
        for (const HexLink& link : fine_.links) of_links.push_back(section_of(link));
        std::sort(of_links.begin(), of_links.end());
        for (auto first = of_links.begin(); first != of_links.end();) {
            const auto last = std::upper_bound(first, of_links.end(), *first);
            if (2 * (last - first) <= whole_width(*first)) sections_.push_back(*first);
            first = last;
        }
    }

    /// Whether the link's two cells have neighbours, outside of their coarse cells to one side,
    /// that are linked in a section which stays closed.
    bool is_joined_beside(const HexLink& link) const {
        const int octant = octant_of(fine_.places[link.lower]);
        for (int axis = 0; axis < 3; ++axis) {
            if (axis == link.axis) continue;
            const bool upwards = octant >> axis & 1;
            for (const std::int32_t a : links_[row_of(link.lower, axis, upwards)])
                for (const std::int32_t b : links_[row_of(link.upper, axis, upwards)]) {
                    const auto above_a = links_[row_of(a, link.axis, true)];
                    if (std::ranges::find(above_a, b) != above_a.end() && !opens({a, b, link.axis}))
                        return true;
                }
        }
        return false;
    }

    void keep_those_joined_beside() {
        std::vector<Section> joined;
        for (const HexLink& link : fine_.links)
            if (opens(link) && is_joined_beside(link)) joined.push_back(section_of(link));
        std::sort(joined.begin(), joined.end());
        sections_ = std::move(joined);
    }

    const HexLevel& fine_;
    std::vector<std::uint8_t> octants_;
    std::vector<Section> sections_;  ///< those to be opened, rising
    Lists links_;  ///< of each cell: its neighbours along x down, x up, y down, ...
};

}  // namespace

std::vector<HexLink> links_without_cut_ends(const HexLevel& fine) {
    const CutEnds ends(fine);
    std::vector<HexLink> links;
    std::ranges::copy_if(fine.links, std::back_inserter(links),
                         [&](const HexLink& link) { return !ends.opens(link); });
    return links;
}

std::size_t count_pieces(const HexLevel& level) {
    DisjointSets cells(level.places.size());
    for (const HexLink& link : level.links) cells.join(link.lower, link.upper);
    std::size_t count = 0;
    for (std::size_t e = 0; e < level.places.size(); ++e) {
        const auto cell = static_cast<std::int32_t>(e);
        count += cells.find(cell) == cell;
    }
    return count;
}

}  // namespace livetet
