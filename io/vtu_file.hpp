#pragma once

#include <filesystem>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Reads the four-node tetrahedra of a VTK unstructured grid (.vtu; text, binary, appended,
/// compressed). Points, lines and faces among its cells are left out, and so are points of no tet.
/// The first of the cell arrays `region`, `regions`, `label`, `labels`, `material`, `materials`,
/// `gmsh:physical`, `medit:ref`, `cell_tags`, `CellEntityIds` (in any case) becomes the regions,
/// whole numbers of 32 bits. Throws Error where the file is malformed or truncated, has no tets, an
/// inverted one, other cells that fill space (with how many of each; ten-node tetrahedra too), or a
/// region that is no whole number.
TetMesh read_vtu(const std::filesystem::path& path, double metres_per_unit);

}  // namespace livetet
