#pragma once

#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The tets around a node.
using Star = std::vector<std::int32_t>;

/// The star of each node.
std::vector<Star> stars_of(const TetMesh& mesh);

/// Mean length of the edges from node `n`, metres. An edge counts once for every tet of the star
/// that contains it.
double mean_edge(const TetMesh& mesh, const Star& star, std::int32_t n);

}  // namespace livetet
