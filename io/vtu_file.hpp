#pragma once

#include <filesystem>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Whether a file is an unstructured grid in VTK's legacy format (.vtk), by its header.
bool is_legacy_grid(const std::filesystem::path& path);

/// Reads the four-node tets of a VTK unstructured grid (.vtu; text, binary, appended, compressed;
/// or a legacy .vtk), or its hexahedra and voxels, if these are those of one grid (grid_of_cells).
/// Points, lines and faces among its cells and unused points are dropped. The regions are the first
/// of the cell arrays `region`, `regions`, `label`, `labels`, `material`, `materials`,
/// `gmsh:physical`, `medit:ref`, `cell_tags`, `CellEntityIds` (in any case), with 32-bit integer
/// values. Throws Error if the file is malformed or truncated, has no such cells, an inverted one,
/// other volume cells (listing the number of each, ten-node tets included), tets beside hexahedra,
/// or a region that is not an integer.
TetMesh read_vtu(const std::filesystem::path& path, double metres_per_unit);

}  // namespace livetet
