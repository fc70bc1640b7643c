#pragma once

#include <filesystem>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Coordinate system of a surface file. STL, PLY, OBJ and VTK files do not state it; Slicer writes
/// LPS since 2020.
enum class Space { ras, lps };

/// Whether the path has the extension of a surface file: .stl, .obj, .ply, .vtk, .vtp or .off.
bool is_surface_name(const std::filesystem::path& path);

/// Reads a surface in mm (.stl, .obj, .ply, .vtk, .vtp, .off) as triangles in metres, RAS. Merges
/// nodes at the same position, drops unused nodes and triangles with two equal nodes, and splits
/// polygons into triangles. Does not check whether the surface is closed. Throws Error if the file
/// is malformed or truncated, has a coordinate that is not finite, or no triangle.
TriangleMesh read_surface(const std::filesystem::path& path, Space space);

/// Writes a surface in mm: .stl (binary), .vtk (legacy) or .ply. Throws Error for another
/// extension.
void write_surface(const std::filesystem::path& path, const TriangleMesh& surface, Space space);

}  // namespace livetet
