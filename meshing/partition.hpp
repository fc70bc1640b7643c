#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// For each tet the number of its part, 0 to parts - 1: parts of about equal size that share few faces (G. Karypis and
/// V. Kumar, A fast and high quality multilevel scheme, 1998, as METIS has it: the dual graph, neighbours share three
/// nodes). The same answer every time. Throws Error if parts < 1 or there are fewer tets than parts; std::runtime_error
/// where METIS fails.
std::vector<std::int32_t> partition_tets(std::span<const Tet> tets, int parts);

}  // namespace livetet
