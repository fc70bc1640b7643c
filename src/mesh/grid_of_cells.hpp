#pragma once

#include <span>
#include <string>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A grid from hexahedra of any source. `mesh`: its nodes and sets. `cells`: corners in VTK's
/// order, round the lower face and then the upper one, beginning with any of them; `regions`: one
/// each, or none. All of each cell is inside the body. Nodes move to the grid that fits best, if
/// the file has rounded them to single precision. Nodes at one place that cells do not share are a
/// cut. Throws Error, naming `where`, if a cell is flat or inverted, if two are at one place, or if
/// they are not those of one grid: equal parallelepipeds at whole multiples of their edges.
TetMesh grid_of_cells(TetMesh mesh, std::span<const Hexahedron> cells,
                      std::span<const std::int32_t> regions, const std::string& where);

}  // namespace livetet
