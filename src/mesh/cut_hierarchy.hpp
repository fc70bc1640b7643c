#pragma once

#include <span>
#include <string>
#include <vector>

#include "mesh/cut_surface.hpp"
#include "mesh/hierarchy.hpp"
#include "mesh/tet_cut.hpp"

namespace livetet {

/// Cuts each level of a hierarchy of four-node tets by `cut_tets`, in place, and counts the changes
/// of the finest one. Transfers and parents do not fit the levels any more: see
/// `with_cut_transfers`. Throws Error, naming `where`, as SegmentCrossings does.
CutCounts cut_levels(std::vector<TetMesh>& levels, const CutSurface& surface,
                     const std::string& where);

/// A hierarchy of levels that were cut; the first may be the second with ten-node tets. A node is
/// mapped into a coarse tet on its own side of the cuts: the one that it is in, or, on the
/// boundary, that a point next to it is in, towards the midst of its tets; where that tet belongs
/// to the other side, the one that SideFinder finds.
MeshHierarchy with_cut_transfers(std::vector<TetMesh> levels, std::string provenance);

/// The levels without some tets of the finest one (one entry each), and without pieces of coarser
/// ones that no node of what is left is in. A coarser level that still has no fewer tets than the
/// finer one, as it hangs together where the finer one was cut, is left out.
std::vector<TetMesh> without_tets(std::vector<TetMesh> levels,
                                  std::span<const std::uint8_t> left_out);

}  // namespace livetet
