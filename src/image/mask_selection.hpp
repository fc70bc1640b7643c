#pragma once

#include "image/image.hpp"
#include "mesh/node_selection.hpp"

namespace livetet {

/// The nodes whose nearest voxel is not zero, sorted. A node outside the image is not in the mask.
/// Throws Error if the image's affine is singular.
std::vector<std::int32_t> nodes_in_mask(const TetMesh& mesh, const LabelImage& mask,
                                        NodeScope scope = NodeScope::all);

}  // namespace livetet
