#pragma once

#include <span>
#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A mesh from hexahedra of any source. `mesh`: its nodes and sets. `cells`: of 8, 20 or 27 nodes,
/// -1 where a cell has none; `regions`: one each, or none.
///
/// A grid, if they have 8 nodes and are those of one: equal parallelepipeds at whole multiples of
/// their edges. All of each cell is inside the body. Nodes move to the grid that fits best, if the
/// file has rounded them to single precision. Nodes at one place that cells do not share are a cut.
/// Triangle sets are left out: node sets have their nodes.
/// Else quadratic hexahedra, whose missing nodes are added (see quadratic_hexahedra).
///
/// Throws Error, naming `where`, if there are none, if a cell is flat or turned over, or if two are
/// at one place.
TetMesh mesh_of_hexahedra(TetMesh mesh, std::vector<QuadraticHexahedron> cells,
                          std::span<const std::int32_t> regions, const std::string& where);

/// Divides hexahedra that another process or a file has given into tets. Throws Error, naming
/// `where`, unless they are those of a grid (hex_level_of) or sound quadratic ones
/// (check_quadratic_mesh).
void divide_hexahedra(TetMesh& mesh, const std::string& where);

}  // namespace livetet
