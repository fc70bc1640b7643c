#pragma once

#include "mesh/hierarchy.hpp"

namespace livetet {

/// Adds `times` finer levels. Each tet of the finest level is cut into eight: four at its corners,
/// and four around the shortest of the three inner diagonals, so angles stay bounded for any number
/// of refinements (J. Bey, Tetrahedral grid refinement, 1995). The body and its straight edges are
/// unchanged; node sets grow as in quadratic_mesh. Nodes are in the order of sort_for_locality.
/// Throws Error if the number of tets would overflow.
MeshHierarchy with_refined_levels(MeshHierarchy hierarchy, int times);

}  // namespace livetet
