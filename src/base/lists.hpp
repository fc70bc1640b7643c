#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <span>
#include <vector>

namespace livetet {

/// Lists of indices stored contiguously (compressed rows).
struct Lists {
    std::vector<std::int32_t> start;  ///< first item of each list, and the end of the last one
    std::vector<std::int32_t> items;

    std::span<const std::int32_t> operator[](std::size_t list) const {
        return {items.data() + start[list], items.data() + start[list + 1]};
    }
};

/// Builds `count` lists. `visit(add)` must call `add(list, item)` for every item, in order within
/// each list. It is called twice: to count and to fill.
template <class Visit>
Lists make_lists(std::size_t count, Visit&& visit) {
    Lists lists;
    lists.start.assign(count + 1, 0);
    visit([&](std::size_t list, std::int32_t) { ++lists.start[list + 1]; });
    std::partial_sum(lists.start.begin(), lists.start.end(), lists.start.begin());
    lists.items.resize(lists.start.back());
    std::vector<std::int32_t> next(lists.start.begin(), lists.start.end() - 1);
    visit([&](std::size_t list, std::int32_t item) { lists.items[next[list]++] = item; });
    return lists;
}

/// Sorts each list and leaves each of its items once. `less`: a strict order of items.
template <class Less = std::less<>>
void sort_and_unique(Lists& lists, Less less = {}) {
    auto end = lists.items.begin();  // lists move up to the gaps that this leaves
    for (std::size_t n = 0; n + 1 < lists.start.size(); ++n) {
        const auto first = lists.items.begin() + lists.start[n],
                   last = lists.items.begin() + lists.start[n + 1];
        std::sort(first, last, less);
        lists.start[n] = static_cast<std::int32_t>(end - lists.items.begin());
        end = std::unique_copy(first, last, end);
    }
    lists.start.back() = static_cast<std::int32_t>(end - lists.items.begin());
    lists.items.erase(end, lists.items.end());
    lists.items.shrink_to_fit();
}

}  // namespace livetet
