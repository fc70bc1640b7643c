#pragma once

#include "meshing/surface_distance.hpp"

namespace livetet {

/// A surface around another one, and what it cost.
struct WrappedSurface {
    TriangleMesh surface;        ///< closed, manifold, free of self-intersections, wound outwards
    HausdorffDistance distance;  ///< to_body: of the wrap from the input; from_body: the reverse
};

/// Wraps triangles of any kind (open, crossing, several times over) by CGAL's alpha wrapping (C.
/// Portaneri, M. Rouxel-Labbé, M. Hemmer, D. Cohen-Steiner, P. Alliez, Alpha wrapping with an
/// offset, 2022). Gaps narrower than `gap_m` are closed, and so are cavities. The wrap lies outside
/// by about a thirtieth of the gap; it is shifted back by that. Precondition: finite nodes and at
/// least one triangle. Throws Error if the wrap encloses nothing.
WrappedSurface wrap_surface(const TriangleMesh& surface, double gap_m);

}  // namespace livetet
