#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/options.hpp"

namespace livetet {

/// A grid of hexahedra from the voxels of a label map.
struct VoxelGrid {
    TetMesh mesh;
    std::array<int, 3> voxels_a_cell{1, 1, 1};
    double body_m3 = 0;  ///< of the body's voxels; the cells' volumes times their shares
    std::vector<std::string> notes;
};

/// Cells of 2^a x 2^b x 2^c voxels along the image's axes: the smallest that are less than twice as
/// long as wide (as far as the voxels allow) and of which there are at most `max_cells`. Every cell
/// with a voxel of the body counts, with the share of the body in it and the label of most of its
/// voxels. Neighbours are linked where voxels of the body touch across their face. Labels, parts
/// and cavities as in `body_mask`. Throws Error as that does, or if the voxels' axes are not
/// orthogonal within 1 degree.
VoxelGrid voxel_grid(const LabelImage& image, const std::vector<std::int32_t>& labels,
                     const BodyChoice& choice, std::int64_t max_cells);

}  // namespace livetet
