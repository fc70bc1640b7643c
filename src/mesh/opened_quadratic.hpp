#pragma once

#include <vector>

#include "mesh/openable_mesh.hpp"

namespace livetet {

/// Opens the ten-node tets of a hierarchy's finest level as the four-node tets below were opened.
/// `before`: all levels as they were, the ten-node ones first; `opened`: what an OpenableMesh made
/// of the others.
///
/// All nodes keep their numbers; the copies of corners follow after all of them, then those of
/// midpoints. So corners are no longer the first nodes. A midpoint is copied where its edge is: it
/// is one node for each pair of ends. Edges stay straight.
OpenedLevels with_opened_quadratic(const std::vector<TetMesh>& before, OpenedLevels opened);

}  // namespace livetet
