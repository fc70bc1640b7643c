#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "image/image.hpp"
#include "io/hdf5.hpp"
#include "mesh/hierarchy_rows.hpp"

namespace livetet {

/// Writes a hierarchy as HDF5, in metres, RAS:
/// - `/levels/0/nodes, tets, regions, node_sets/NAME, triangle_sets/NAME`: a mesh, level 0 the
///   finest;
/// - for a grid `/levels/0/hexahedra` in place of tets, in the order of VTK and XDMF, and `shares`;
///   regions are then those of the hexahedra;
/// - `/transfers/0/nodes, weights, distance`: the map from level 0 to level 1;
/// - `/provenance`; `/world`, which is "RAS, metres";
/// - `/image/size, ras_from_voxel, spacing`: the grid of the image that was meshed, if any.
void write_hierarchy(const std::filesystem::path& path, const MeshHierarchy& hierarchy,
                     const std::optional<ImageGrid>& image = {});

/// The grid of the image that a hierarchy file's meshes were made from; none if there was no image
/// or the file is of an older version. Throws Error if it is inconsistent.
std::optional<ImageGrid> read_image_grid(const std::filesystem::path& path);

/// Reads a file of `write_hierarchy`. Throws Error, naming file and table, if it is inconsistent:
/// format, sizes, indices, inverted tets, weights that do not sum to one.
MeshHierarchy read_hierarchy(const std::filesystem::path& path);

/// The same on each rank of `comm`, of its rows of meshes of tets: no rank reads more. Whether tets
/// have positive volumes, and nodes tets, is seen where the meshes are distributed. Throws Error on
/// all ranks alike, also for a grid of hexahedra. Collective.
HierarchyRows read_hierarchy_rows(MPI_Comm comm, const std::filesystem::path& path);

/// Write and read one mesh in a group of an HDF5 file; also used by other formats. Of a file that
/// several ranks write, each gives its rows of the mesh: some of its nodes, of its tets and of each
/// set, those of lower ranks first, in numbers of the whole mesh; all ranks name all sets.
void write_mesh(hdf5::File& file, const std::string& group, const TetMesh& mesh);
/// Size of the mesh's tables in a file, bytes.
std::size_t bytes_written(const TetMesh& mesh);
TetMesh read_mesh(const hdf5::File& file, const std::string& group);

}  // namespace livetet
