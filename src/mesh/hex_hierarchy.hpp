#pragma once

#include "mesh/hex_grid.hpp"
#include "mesh/hierarchy.hpp"

namespace livetet {

/// A grid and its coarser levels, as levels and as meshes.
struct GridHierarchy {
    std::vector<HexLevel> levels;  ///< see hex_levels
    /// Meshes of cells twice as long from level to level. A coarse cell's share is that of its
    /// cells in its volume, its region the one that most of this is of; sets are the finest
    /// level's alone. Transfers are linear in Kuhn's tets of the coarse cells (tets_of_hexahedra),
    /// never across a cut; `places_in_coarser` has the trilinear ones.
    MeshHierarchy meshes;
};

/// `grid`: a mesh of hexahedra; `enough`: as hex_levels.
GridHierarchy grid_hierarchy(const TetMesh& grid, std::size_t enough);

}  // namespace livetet
