#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/hex_grid.hpp"

/// Transfer between nested levels of a grid: a node of a level lies in a cell of the next coarser
/// one, at one of the 27 places that the cell's halves have for corners.
namespace livetet {

inline constexpr int places_in_parent = 27;

/// The place in the parent of a corner of the cell in an octant: i + 3 j + 9 k is at (i, j, k) / 2.
int place_in_parent(int octant, int corner);

/// Values of a cell's eight corner functions at each place: trilinear.
const std::array<std::array<double, 8>, places_in_parent>& corner_values_at_places();

/// For each node of a level whose parents are known: 27 times a coarse cell, and the place in it.
/// Where several cells have the node, what they say is the same.
std::vector<std::int32_t> places_in_coarser(const HexLevel& fine);

}  // namespace livetet
