#pragma once

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A mesh for `unpacked_mesh` in the parent of a child process; false, said on stderr, where the
/// system refuses.
bool write_mesh(int descriptor, const TetMesh& mesh);

}  // namespace livetet
