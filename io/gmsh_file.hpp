#pragma once

#include <filesystem>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Reads a Gmsh mesh (.msh 2.2 or 4.x, ascii or binary). Physical groups become
/// - volumes: regions, by their numbers (0: in no group);
/// - surfaces: triangle sets, wound outwards where they bound the body, and node sets;
/// - curves and points: node sets.
///
/// A group without a name is called "surface_3", "curve_3" or "point_3". Nodes that belong to none
/// of the volume elements are dropped. Eight-node hexahedra are read, too, if all volume elements
/// are those of one grid (grid_of_cells); groups of surfaces are then node sets alone. Throws Error
/// if the file is truncated or malformed, has no volume elements, an inverted one, others than
/// these, or a group without any node of the body.
TetMesh read_gmsh(const std::filesystem::path& path, double metres_per_unit);

/// Writes a mesh as MSH 2.2, ascii, readable by `read_gmsh` with the same `metres_per_unit`, by
/// Gmsh and by PETSc's DMPlex. Region r becomes physical volume r.
void write_gmsh(const std::filesystem::path& path, const TetMesh& mesh, double metres_per_unit);

}  // namespace livetet
