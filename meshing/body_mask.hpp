#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A body's voxels, cropped to it with one empty voxel all round.
struct BodyMask {
    Image<std::uint8_t> mask;        ///< 1 inside; its affine is that of the cropped grid
    std::int64_t picked_voxels = 0;  ///< with the labels asked for, in the whole image
    std::int64_t body_voxels = 0;    ///< of the largest part, holes filled
    std::array<int, 3>
        corner{};  ///< the mask's voxel (0, 0, 0) in the image, which may be one beyond its border
    std::map<std::int32_t, std::int64_t>
        label_voxels{};  ///< how many of each label the largest part has
};

/// The largest part (voxels that share a face; of equal ones the first in memory) of the voxels
/// with these labels (all but 0 if empty), with the holes that background cannot reach through
/// faces filled. Throws Error, listing the labels that are there, if one asked for is not.
BodyMask largest_component(const LabelImage& image, std::span<const std::int32_t> labels);

/// The faces between the mask's voxels and the rest, two triangles each, in metres; nodes are not
/// shared. Precondition: the mask's rim is empty.
TriangleMesh voxel_faces(const Image<std::uint8_t>& mask);

/// The same of all voxels of an image whose label is not 0; the image's border counts as one of
/// theirs. Throws Error where there are none.
TriangleMesh mask_faces(const LabelImage& image);

}  // namespace livetet
