#pragma once

#include <span>
#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A rigid motion that nothing holds.
struct FreeMotion {
    std::string description;  ///< "translation along (0, 0, 1)", "rotation about (0, 0, 1) through (1.0, 2.0, 3.0) mm"
};

/// The rigid motions of each connected piece of the mesh that its held components leave free: what a static solve has
/// no answer for. `held`: for every node, bit 0: x, 1: y, 2: z. O(tets).
std::vector<FreeMotion> free_rigid_motions(const TetMesh& mesh, std::span<const std::uint8_t> held);

}  // namespace livetet
