#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "mesh/hex_grid.hpp"

namespace livetet {

/// Numbers of the places of a grid, and of the links between them, row by row over the grid's box.
class PlaceNumbers {
  public:
    explicit PlaceNumbers(std::span<const HexPlace> places) {
        for (const HexPlace& place : places)
            for (int d = 0; d < 3; ++d) size_[d] = std::max(size_[d], place[d] + 1);
    }
    /// Number of places along an axis, from 0.
    std::int32_t size(int axis) const { return size_[axis]; }
    std::int64_t of_place(const HexPlace& place) const {
        return (std::int64_t{place[2]} * size_[1] + place[1]) * size_[0] + place[0];
    }
    /// Of the link from a place along an axis.
    std::int64_t of_link(const HexPlace& lower, int axis) const {
        return of_place(lower) * 3 + axis;
    }

  private:
    HexPlace size_{0, 0, 0};
};

}  // namespace livetet
