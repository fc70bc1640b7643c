#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "apps/scene/selection_options.hpp"
#include "solvers/parallel/mesh_part.hpp"

namespace livetet {

/// The set of nodes and triangles, of a mesh with the scene's cuts, that was its surface before
/// them, copies of doubled nodes included. Files keep it.
inline constexpr const char* surface_before_cuts = "surface before cuts";

/// The nodes of a selection, as local nodes of a part, sorted. Walls of cuts are no surface,
/// if the mesh has the set `surface_before_cuts`. Throws Error, naming `key`, if there
/// are none on any rank. Collective.
std::vector<std::int32_t> select_nodes(const MeshPart& part, const SelectionOptions& selection,
                                       const std::string& key);

/// What each of the nodes of a selection bears of a force or a stiffness that they share, in all 1:
/// alike, on a grid by the tissue around each. A border cell that holds little of the body cannot
/// bear what a whole one can. Collective.
std::vector<double> shares_of_nodes(const MeshPart& part, std::span<const std::int32_t> nodes);

/// The nodes that count as surface in selections, sorted; of a whole mesh.
std::vector<std::int32_t> selectable_surface(const TetMesh& mesh);

}  // namespace livetet
