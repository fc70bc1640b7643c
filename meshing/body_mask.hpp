#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/options.hpp"

namespace livetet {

/// Separate groups of voxels.
struct VoxelGroups {
    std::int64_t count = 0, voxels = 0;
};

/// A body's voxels, cropped to their bounding box plus one empty voxel on each side.
struct BodyMask {
    Image<std::uint8_t> mask;        ///< 1 inside; the affine is that of the cropped grid
    std::int64_t picked_voxels = 0;  ///< voxels with the requested labels in the whole image
    std::int64_t body_voxels = 0;    ///< voxels of the body, those of filled cavities included
    /// Image index of the mask's voxel (0, 0, 0); may be one beyond the image's border.
    std::array<int, 3> corner{};
    /// Number of the image's own voxels of each label in the body.
    std::map<std::int32_t, std::int64_t> label_voxels{};
    std::vector<std::int64_t> parts{};     ///< voxels of each part of the body, the largest first
    std::vector<std::int64_t> cavities{};  ///< voxels of each cavity that is kept, likewise
    VoxelGroups filled{};                  ///< cavities that were filled
    VoxelGroups specks{};                  ///< parts left out for their size
    /// Voxels of each label in larger parts that were left out.
    std::map<std::int32_t, std::int64_t> left_out{};
    std::vector<std::int32_t> lost_labels{};  ///< of which there are specks only
};

/// The voxels with the given labels (all but 0 if empty) that form the body. Parts are connected by
/// faces; of equal ones the first in memory counts as the largest. A cavity is what the outside
/// does not reach through faces; parts that are left out count as empty. Throws Error, listing the
/// existing labels, if a requested one does not exist.
BodyMask body_mask(const LabelImage& image, std::span<const std::int32_t> labels,
                   const BodyChoice& choice = {});

/// The faces between the mask's voxels and the rest as a surface in metres: two triangles each,
/// nodes not shared. Precondition: the mask's outermost voxels are empty.
TriangleMesh voxel_faces(const Image<std::uint8_t>& mask);

/// The same for all voxels of an image whose label is not 0, closed at the image's border. Throws
/// Error if there are none.
TriangleMesh mask_faces(const LabelImage& image);

}  // namespace livetet
