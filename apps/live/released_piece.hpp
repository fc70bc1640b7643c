#pragma once

#include <vector>

#include "mesh/mesh_pieces.hpp"

namespace livetet {

/// Places a piece of a static body that nothing pulls any more. It takes its shape at rest, where
/// the rigid motion nearest to its displacement moves it. If that is farther than the body is
/// large, as a piece may be that hung by a last bridge, or not finite, it goes back to its place at
/// rest. `displacement`: of all nodes of the mesh, m; that of the piece changes. Returns false if
/// it went back.
bool release_piece(const MeshPiece& piece, const TetMesh& mesh, std::vector<Vector3>& displacement);

}  // namespace livetet
