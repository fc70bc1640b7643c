#pragma once

#include <vector>

#include "mesh/hex_grid.hpp"

namespace livetet {

/// The links of a level that its next coarser one is to keep. Those are left out at which a cut
/// ends inside a coarse cell, or inside a face between two, if at least half of the cell's section
/// (its middle along an axis), or of the face, is cut already.
///
/// A coarse cell that is one linked part closes the cut that ends in it up to its own border. So a
/// bridge that a cut leaves would be wider on each level, and stiffer by the cube of that. Without
/// these links the cut goes on to the coarse cell's far border, where the two sides still have the
/// nodes of the next cell in common. A section stays as it is if nothing beside it joins its sides.
///
/// `fine.parents`: its coarse cells with all of its links. Returns all links where no cut ends so.
std::vector<HexLink> links_without_cut_ends(const HexLevel& fine);

/// Number of parts of a level that no link joins.
std::size_t count_pieces(const HexLevel& level);

}  // namespace livetet
