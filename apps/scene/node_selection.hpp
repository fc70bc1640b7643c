#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/scene/selection_options.hpp"
#include "solvers/parallel/mesh_part.hpp"

namespace livetet {

/// The nodes of a selection, as local nodes of a part, sorted. Throws Error, naming `key`, if there
/// are none on any rank. Collective.
std::vector<std::int32_t> select_nodes(const MeshPart& part, const SelectionOptions& selection,
                                       const std::string& key);

}  // namespace livetet
