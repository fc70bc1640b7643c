#pragma once

#include <filesystem>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Reads a Gmsh mesh (.msh 2.2 or 4.x, ascii or binary). Physical volumes become regions (their
/// numbers; 0: in none), physical surfaces triangle sets, wound outwards where they bound the body,
/// and node sets; physical curves and points node sets. A group without a name is "surface_3",
/// "curve_3" or "point_3". Nodes that belong to no tet are left out. Throws Error where the file is
/// truncated or malformed, has no tets, an inverted one, volume elements that are not four-node
/// tetrahedra, or a group that lies wholly off the body.
TetMesh read_gmsh(const std::filesystem::path& path, double metres_per_unit);

/// Writes a mesh as MSH 2.2, ascii, for `read_gmsh` with the same `metres_per_unit`, Gmsh and
/// PETSc's DMPlex. Region r is physical volume r.
void write_gmsh(const std::filesystem::path& path, const TetMesh& mesh, double metres_per_unit);

}  // namespace livetet
