#pragma once

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The permutations of nodes and tets.
struct Renumbering {
    std::vector<std::int32_t> number_of_node;  ///< old number -> new
    std::vector<std::int32_t> tets;            ///< new number -> old
};

/// Renumbers a mesh so that neighbours in space are close in memory: nodes along a Hilbert curve
/// (J. Skilling, Programming the Hilbert curve, 2004), tets by their lowest node, then by the
/// others. Positions, orientations, regions and named sets are unchanged. The result is
/// deterministic and independent of the initial order of the nodes.
Renumbering sort_for_locality(TetMesh& mesh);

}  // namespace livetet
