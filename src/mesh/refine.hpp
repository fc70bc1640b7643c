#pragma once

#include <array>

#include "mesh/hierarchy.hpp"

namespace livetet {

/// The eight tets that a tet of corners `corners` and midpoints `middles` (in the order of
/// `tet_edges`) is cut into: one at each corner, and four around the shortest of the three inner
/// diagonals. Numbers are those of `places`, m.
std::array<Tet, 8> children_of(const Tet& corners, const std::array<std::int32_t, 6>& middles,
                               std::span<const Vector3> places);

/// The four triangles that a triangle is cut into; middles: of its edges 01, 12, 20.
std::array<Triangle, 4> children_of(const Triangle& corners, const Triangle& middles);

/// Throws Error if so many tets, each cut into eight, are more than there are numbers.
void check_can_refine(std::size_t tets);

/// Adds `times` finer levels. Each tet of the finest level is cut into eight, so that angles stay
/// bounded for any number of refinements (J. Bey, Tetrahedral grid refinement, 1995). The body and
/// its straight edges are unchanged; node sets grow as in quadratic_mesh.
///
/// A fine node's number follows from its surroundings alone, so that ranks which know no more find
/// the same: after each coarse node come the midpoints of its edges to higher nodes, rising with
/// these. The children of tet e are 8 e to 8 e + 7. Throws Error if the number of tets would
/// overflow.
MeshHierarchy with_refined_levels(MeshHierarchy hierarchy, int times);

}  // namespace livetet
