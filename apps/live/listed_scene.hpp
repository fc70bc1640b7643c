#pragma once

#include <span>
#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/mesh_pieces.hpp"

namespace livetet {

/// A scene whose fix, drive and loads select nodes by lists, or loads by groups of the mesh, and
/// whose turns have centres: so that nothing of it is read again from files when the mesh is cut
/// further, and nothing jumps. Its cuts are left out, as `mesh` has them. Throws Error as
/// select_nodes does.
Scene listed_scene(const Scene& scene, const TetMesh& mesh);

/// Adds the copies of nodes to the lists of a listed_scene; see add_copies.
void add_copies_to_lists(Scene& listed, std::size_t first, std::span<const std::int32_t> originals);

/// The pieces of a mesh, and what the fixed and driven nodes of a listed_scene hold.
struct HeldPieces {
    std::size_t count = 0;
    /// In dynamic scenes those of which no node is held, in static ones those that can move as
    /// rigid bodies. Of a body that nothing holds, all but the largest.
    std::vector<MeshPiece> free;
    /// A piece is held and can deform, or the scene holds nothing.
    bool is_any_left = false;
};
HeldPieces held_pieces(const Scene& listed, const TetMesh& mesh);

}  // namespace livetet
