#pragma once

#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

/// Where the surface of a body is in its grid of hexahedra. Cells at the border may hold little of
/// the body, and what is driven or loaded at their outer nodes hangs by next to nothing: a patch
/// driven there is a third too soft on cells of 6 mm; pressures tear such cells off. So the body
/// counts as ending where its solid cells do: those at least half inside, and those without a solid
/// cell at any of their nodes, as in sheets thinner than half a cell. Their faces are within half a
/// cell of the surface.
namespace livetet {

/// Whether each cell is solid. `mesh` has shares; either order.
std::vector<std::uint8_t> solid_cells(const TetMesh& mesh);

/// The tets of solid cells; all tets of a mesh without shares.
std::vector<Tet> solid_tets(const TetMesh& mesh);

/// The faces in which they end, wound outwards; of a mesh without shares its boundary.
std::vector<Triangle> body_surface(const TetMesh& mesh);

/// Nodes that are not between solid cells all around, sorted: those of the faces in which the solid
/// cells end, and all beyond. `mesh` has shares; either order.
std::vector<std::int32_t> border_nodes(const TetMesh& mesh);

/// Of each node of a mesh with shares: what of the cells around it is inside the body, from 0 to 1.
/// Both sides of a cut count for its nodes on their own.
std::vector<double> tissue_around(const TetMesh& mesh);

}  // namespace livetet
