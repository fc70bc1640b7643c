#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace livetet {

/// Sets of numbers that are joined (union-find, by path halving).
class DisjointSets {
  public:
    /// Each of 0 to count - 1 alone.
    explicit DisjointSets(std::size_t count) : up_(count) { std::iota(up_.begin(), up_.end(), 0); }
    /// The least of the set of i.
    std::int32_t find(std::int32_t i) {
        while (up_[i] != i) i = up_[i] = up_[up_[i]];
        return i;
    }
    void join(std::int32_t a, std::int32_t b) {
        a = find(a), b = find(b);
        up_[std::max(a, b)] = std::min(a, b);  // the first of a class stands for it
    }

  private:
    std::vector<std::int32_t> up_;
};

}  // namespace livetet
