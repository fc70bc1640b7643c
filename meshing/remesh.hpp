#pragma once

#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"
#include "meshing/options.hpp"

namespace livetet {

/// Pairs of triangles that intersect.
struct SelfIntersections {
    std::int64_t pairs = 0;
    Vector3 place = Vector3::Zero();  ///< of the first pair, metres
};

/// Counts the pairs of triangles that intersect other than in a shared node or edge. Precondition:
/// closed and manifold.
SelfIntersections find_self_intersections(const TriangleMesh& surface);

/// Repairs a surface so that it bounds the body of `choice`: closed, manifold, wound outwards.
/// Merges nodes at the same position, drops degenerate and duplicate triangles, makes the winding
/// consistent, and fills holes narrower than a tenth of the body. A shell within another bounds a
/// cavity. `notes`, if given, receives a line for each change of the body: holes filled, cavities
/// kept or filled, parts dropped. Throws Error (counts of border and non-manifold edges, a position
/// in mm) if that is not enough.
TriangleMesh repair_surface(const TriangleMesh& surface, const BodyChoice& choice = {},
                            std::vector<std::string>* notes = nullptr);

/// Remeshes a repaired surface with triangles of about the same size and shape (M. Botsch and L.
/// Kobbelt, A Remeshing Approach to Multiresolution Modeling, 2004, as implemented in CGAL). Then
/// shifts the nodes of each shell along their normals, by at most 0.3 edges, to restore its volume.
/// The result has as many shells as the input; it is closed, manifold, free of self-intersections
/// and wound outwards. If `edge_length_m` is too coarse for that, it is reduced, in at most `tries`
/// attempts; it returns the value that worked. Edges are shorter, in steps of a factor of 0.7,
/// where `shorter_at` asks for less than `edge_length_m`. Throws Error with the position (mm) of
/// the remaining fault, or the surface's bounding box.
TriangleMesh remesh_surface(const TriangleMesh& surface, double& edge_length_m, int iterations,
                            int tries, const EdgeLengthField& shorter_at = {});

}  // namespace livetet
