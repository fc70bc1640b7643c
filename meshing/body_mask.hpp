#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/image.hpp"

namespace livetet {

/// A body's voxels, cropped to it with one empty voxel all round.
struct BodyMask {
    Image<std::uint8_t> mask;        ///< 1 inside; its affine is that of the cropped grid
    std::int64_t picked_voxels = 0;  ///< with the labels asked for, in the whole image
    std::int64_t body_voxels = 0;    ///< of the largest part, holes filled
};

/// The largest part (voxels that share a face; of equal ones the first in memory) of the voxels with these labels (all
/// but 0 if empty), with the holes that background cannot reach through faces filled. Throws Error, listing the labels
/// that are there, if one asked for is not.
BodyMask largest_body(const LabelImage& image, std::span<const std::int32_t> labels);

}  // namespace livetet
