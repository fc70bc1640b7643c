#pragma once

#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The tets about a node.
using Star = std::vector<std::int32_t>;

/// Those of each node.
std::vector<Star> stars_of(const TetMesh& mesh);

/// The mean length of the edges from node `n`, each counted once for every tet of its star that has
/// it; metres.
double mean_edge(const TetMesh& mesh, const Star& star, std::int32_t n);

}  // namespace livetet
