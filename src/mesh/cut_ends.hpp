#pragma once

#include <vector>

#include "mesh/hex_grid.hpp"

namespace livetet {

/// The links of a level that its next coarser one is to keep where a cut ends inside a coarse cell,
/// or inside a face between two.
///
/// A coarse cell that is one linked part closes the cut that ends in it up to its own border. So a
/// bridge that a cut leaves would be wider on each level, and stiffer by the cube of that. Of each
/// section of a coarse cell (its middle along an axis) and each face between coarse cells, of up to
/// four links, those are left out of which no more than half are uncut, if what they join stays
/// joined beside them. Then the cut ends at the coarse cell's far border: at the nearer of both.
///
/// `fine.parents`: its coarse cells with all of its links. Returns all links where no cut ends so.
std::vector<HexLink> links_without_cut_ends(const HexLevel& fine);

/// Number of parts of a level that no link joins.
std::size_t count_pieces(const HexLevel& level);

}  // namespace livetet
