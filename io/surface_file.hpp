#pragma once

#include <filesystem>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Which way a surface file's axes point: STL, PLY, OBJ and VTK files do not say. Slicer writes LPS
/// since 2020.
enum class Space { ras, lps };

/// Reads a surface in mm (.stl, .obj, .ply, .vtk, .vtp, .off) as triangles in metres, RAS. Nodes at
/// the same place become one; nodes of no triangle are left out; triangles with two equal nodes are
/// kept out as well, polygons are cut into triangles. Whether it is closed is not asked here.
/// Throws Error where the file is malformed, truncated, has a coordinate that is not finite, or no
/// triangle.
TriangleMesh read_surface(const std::filesystem::path& path, Space space);

/// Writes a surface in mm: .stl (binary), .vtk (legacy) or .ply. Throws Error where the name has
/// another ending.
void write_surface(const std::filesystem::path& path, const TriangleMesh& surface, Space space);

}  // namespace livetet
