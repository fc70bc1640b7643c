#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/scene/selection_options.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The nodes of a selection. Throws Error, naming `key`, if there are none.
std::vector<std::int32_t> select_nodes(const TetMesh& mesh, const SelectionOptions& selection,
                                       const std::string& key);

}  // namespace livetet
