#pragma once

#include <cstdint>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

enum class NodeScope { all, surface_only };

/// The nodes whose nearest voxel is not zero, sorted. A node outside the image is not in the mask.
/// Throws Error if the image's affine is singular.
std::vector<std::int32_t> nodes_in_mask(const TetMesh& mesh, const LabelImage& mask,
                                        NodeScope scope = NodeScope::all);

/// The nodes in the closed box from `low` to `high` (metres, RAS), sorted. Throws Error if low >
/// high along an axis.
std::vector<std::int32_t> nodes_in_box(const TetMesh& mesh, const Vector3& low, const Vector3& high,
                                       NodeScope scope = NodeScope::all);

/// The nodes within `radius` (metres) of `centre`, sorted. Throws Error if the radius is negative.
std::vector<std::int32_t> nodes_in_sphere(const TetMesh& mesh, const Vector3& centre, double radius,
                                          NodeScope scope = NodeScope::all);

/// The nodes x with (x - point) . normal <= 0: the side that the normal points away from, its plane
/// included, sorted. Throws Error if the normal is zero.
std::vector<std::int32_t> nodes_in_half_space(const TetMesh& mesh, const Vector3& point,
                                              const Vector3& normal,
                                              NodeScope scope = NodeScope::all);

}  // namespace livetet
