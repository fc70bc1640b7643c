#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A body's voxels, cropped to their bounding box plus one empty voxel on each side.
struct BodyMask {
    Image<std::uint8_t> mask;        ///< 1 inside; the affine is that of the cropped grid
    std::int64_t picked_voxels = 0;  ///< voxels with the requested labels in the whole image
    std::int64_t body_voxels = 0;    ///< voxels of the largest part with its holes filled
    /// Image index of the mask's voxel (0, 0, 0); may be one beyond the image's border.
    std::array<int, 3> corner{};
    /// Number of voxels of each label in the largest part.
    std::map<std::int32_t, std::int64_t> label_voxels{};
};

/// The largest part of the voxels with the given labels (all but 0 if empty), with its holes
/// filled. Parts are connected by faces; of equal ones the first in memory counts. A hole is
/// background that the outside does not reach through faces. Throws Error, listing the existing
/// labels, if a requested one does not exist.
BodyMask largest_component(const LabelImage& image, std::span<const std::int32_t> labels);

/// The faces between the mask's voxels and the rest as a surface in metres: two triangles each,
/// nodes not shared. Precondition: the mask's outermost voxels are empty.
TriangleMesh voxel_faces(const Image<std::uint8_t>& mask);

/// The same for all voxels of an image whose label is not 0, closed at the image's border. Throws
/// Error if there are none.
TriangleMesh mask_faces(const LabelImage& image);

}  // namespace livetet
