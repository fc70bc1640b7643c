#pragma once

#include <span>
#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A P1 mesh with its regions and sets as bytes, for `unpacked_mesh` in another process of this
/// machine.
std::vector<char> packed(const TetMesh& mesh);

/// What `packed` made. Throws Error, naming `who` made it, where bytes are missing or left over, or
/// a set names a node that is not there; the tets are for `check_tet_mesh`.
TetMesh unpacked_mesh(std::span<const char> bytes, const std::string& who);

}  // namespace livetet
