#pragma once

#include "mesh/hierarchy.hpp"

namespace livetet {

/// `hierarchy` with a finer level in front, `times` over: each tet of the finest is cut into eight,
/// four at its corners and four about the shortest of the three inner diagonals (J. Bey,
/// Tetrahedral grid refinement, 1995: angles stay bounded however often). The body stays what it
/// was, straight edges and all; node sets grow as quadratic_mesh says. Nodes are in the order of
/// sort_for_locality. Throws Error where there would be more tets than can be counted.
MeshHierarchy with_refined_levels(MeshHierarchy hierarchy, int times);

}  // namespace livetet
