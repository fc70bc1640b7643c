#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/hierarchy.hpp"
#include "mesh/mesh_pieces.hpp"

namespace livetet {

/// Throws Error if a scene has cuts or blades that its mesh, which is not read yet, is known not to
/// take: blades with ten-node tets in the mixed form, or pieces that are left out while selections
/// list nodes.
void check_can_be_cut(const Scene& scene);

/// Throws the Error for a blade with ten-node tets in the mixed form: `formulation` asks for it, or
/// the materials do.
[[noreturn]] void refuse_blade_in_mixed_form();

/// The scene's mesh with its cuts, all levels of tets alike, and without pieces that they free if
/// the scene leaves those out. Logs how much was cut, and each piece that nothing holds. Throws
/// Error, naming the key, if a cut parts no tet or crosses no pair of neighbouring cells, if all
/// cuts together open no gap, if pieces are free and the scene refuses them, or if nothing would be
/// left that is held and can deform.
MeshHierarchy with_cuts(const Scene& scene, MeshHierarchy hierarchy);

/// The nodes of pieces of a cut mesh that stay at rest because neither fix nor drive holds them:
/// in static scenes with `free_pieces: keep`, else none. Sorted.
std::vector<std::int32_t> resting_nodes(const Scene& scene, const TetMesh& mesh);

/// "1 piece that neither fix nor drive holds: 3.2 ml at (1.0, 2.0, 3.0) mm".
std::string pieces_text(const std::vector<MeshPiece>& pieces);

/// What the scene's cuts made of a result's first mesh: "1 cut; the body is in 2 pieces: 12.3 ml,
/// 8.2 ml; pieces that nothing holds are left out" (the rule: there may be none). Empty without
/// cuts.
std::string cuts_text(const Scene& scene, const TetMesh& mesh);

/// All keys that the scene's mesh depends on, as text: scenes with equal texts have equal meshes.
std::string mesh_identity(const Scene& scene);

}  // namespace livetet
