#pragma once

#include <algorithm>
#include <vector>

namespace livetet {

/// Sorts a list and leaves each of its items once.
template <class T>
void sort_and_unique(std::vector<T>& list) {
    std::ranges::sort(list);
    const auto rest = std::ranges::unique(list);
    list.erase(rest.begin(), rest.end());
}

}  // namespace livetet
