#pragma once

#include <span>

#include "image/image.hpp"
#include "mesh/node_selection.hpp"

namespace livetet {

/// The nodes whose nearest voxel is not zero, sorted. Nodes outside the image are not selected.
/// Throws Error if the image's affine is singular.
std::vector<std::int32_t> nodes_in_mask(const TetMesh& mesh, const LabelImage& mask,
                                        NodeScope scope = NodeScope::all);

/// Throws Error unless a voxel of the mask lies within half a voxel of the bounding box of
/// `positions`, metres.
void check_mask_reaches(const LabelImage& mask, std::span<const Vector3> positions);

}  // namespace livetet
