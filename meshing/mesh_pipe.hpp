#pragma once

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Writes a mesh to a parent process, which reads it with `unpacked_mesh`. Returns false, with a
/// message on stderr, if the system refuses.
bool write_mesh(int descriptor, const TetMesh& mesh);

}  // namespace livetet
