#pragma once

#include <vector>

#include "mesh/mesh_pieces.hpp"

namespace livetet {

/// Places a piece of a static body that nothing pulls any more: it takes its shape at rest, where
/// the rigid motion nearest to its displacement moves it. It goes back to its place at rest if it
/// is farther away than the body is large, or if no rigid motion is near its displacement: a last
/// bridge may have drawn it out to a line. `displacement`: of all nodes of the mesh, m; that of the
/// piece changes. Returns false if it went back.
bool release_piece(const MeshPiece& piece, const TetMesh& mesh, std::vector<Vector3>& displacement);

}  // namespace livetet
