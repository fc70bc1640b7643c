#pragma once

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Where nodes and tets went.
struct Renumbering {
    std::vector<std::int32_t> number_of_node;  ///< old number -> new
    std::vector<std::int32_t> tets;            ///< new number -> old
};

/// Renumbers a mesh so that what is near in space is near in memory: nodes along a Hilbert curve
/// (J. Skilling, Programming the Hilbert curve, 2004), tets by their lowest node, then the others.
/// Positions, orientations, regions and named sets stay what they were. Deterministic, and the same
/// for every order of the nodes given.
Renumbering sort_for_locality(TetMesh& mesh);

}  // namespace livetet
