#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "apps/live/response_body.hpp"

namespace livetet {

/// Replaces what selects fixed and driven nodes by lists of them, so that no file is read again.
/// Throws Error as select_nodes does.
void list_selected_nodes(Scene& scene, const TetMesh& mesh);

/// What holds the scene's body beside its patches.
Holding scene_holding(const Scene& scene, const TetMesh& mesh);

/// A set of nodes and those within a distance (m) from its nodes on the surface; sorted.
std::vector<int> widened(const TetMesh& mesh, const std::vector<int>& set, NodeScope where,
                         double distance);

/// For each node of a coarse mesh's surface, the nearest node of the fine one's; -1 inside.
std::vector<std::int32_t> nearest_on_surface(const TetMesh& coarse, const TetMesh& fine);

/// Each node held as one of another mesh; -1: free. Springs are left out.
Holding on_other_nodes(const Holding& held, std::span<const std::int32_t> others);

}  // namespace livetet
