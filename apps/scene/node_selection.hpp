#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/scene/selection_options.hpp"
#include "solvers/parallel/mesh_part.hpp"

namespace livetet {

/// The node set, of a mesh with the scene's cuts, that was its surface before them, copies of
/// doubled nodes included.
inline constexpr const char* surface_before_cuts = "surface before cuts";

/// The nodes of a selection, as local nodes of a part, sorted. Walls of the scene's cuts do not
/// count as surface; those of cuts that the mesh file has do. Throws Error, naming `key`, if there
/// are none on any rank. Collective.
std::vector<std::int32_t> select_nodes(const MeshPart& part, const SelectionOptions& selection,
                                       const std::string& key);

}  // namespace livetet
