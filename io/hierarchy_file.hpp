#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "image/image.hpp"
#include "io/hdf5.hpp"
#include "mesh/hierarchy.hpp"

namespace livetet {

/// Writes a hierarchy as HDF5, in metres: `/levels/0/nodes, tets, regions, node_sets/NAME,
/// triangle_sets/NAME`, level 0 the finest; `/transfers/0/nodes, weights, distance`; `/provenance`;
/// `/world`, which is "RAS, metres"; and of the image that it was meshed from `/image/size,
/// ras_from_voxel, spacing`.
void write_hierarchy(const std::filesystem::path& path, const MeshHierarchy& hierarchy,
                     const std::optional<ImageGrid>& image = {});

/// Where the voxels lie of the image that a hierarchy file's meshes were made from; none where it
/// was no image, or the file is of an older version. Throws Error where that does not hold
/// together.
std::optional<ImageGrid> read_image_grid(const std::filesystem::path& path);

/// Reads what `write_hierarchy` wrote. Throws Error, naming file and table, where anything does not
/// hold together: format, sizes, indices, tets that are inverted, weights that do not sum to one.
MeshHierarchy read_hierarchy(const std::filesystem::path& path);

/// One mesh within a group of an HDF5 file, for other formats to hold.
void write_mesh(hdf5::File& file, const std::string& group, const TetMesh& mesh);
/// What its tables take in a file, bytes.
std::size_t bytes_written(const TetMesh& mesh);
TetMesh read_mesh(const hdf5::File& file, const std::string& group);

}  // namespace livetet
