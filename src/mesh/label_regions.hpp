#pragma once

#include <span>

#include "mesh/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The label of each tet: that of the voxel at its centroid, or where that is none of the body's, of the nearest one
/// (within five voxels; beyond, the body's most frequent label). `labels`: the body's; empty: all but 0. Empty where
/// the image has none of them.
std::vector<std::int32_t> regions_by_label(const TetMesh& mesh, const LabelImage& image,
                                           std::span<const std::int32_t> labels);

}  // namespace livetet
