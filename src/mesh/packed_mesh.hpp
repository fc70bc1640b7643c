#pragma once

#include <span>
#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Serialises a P1 mesh or a grid, its regions and sets, for another process on the same machine.
std::vector<char> packed(const TetMesh& mesh);

/// Restores a mesh from the bytes of `packed`. Throws Error, naming the sender `who`, if bytes are
/// missing or left over or a set contains an invalid node. Does not check the tets; see
/// `check_tet_mesh`.
TetMesh unpacked_mesh(std::span<const char> bytes, const std::string& who);

}  // namespace livetet
