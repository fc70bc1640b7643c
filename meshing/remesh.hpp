#pragma once

#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"
#include "meshing/options.hpp"

namespace livetet {

/// Pairs of triangles that cut each other.
struct SelfIntersections {
    std::int64_t pairs = 0;
    Vector3 place = Vector3::Zero();  ///< metres: of the first pair
};

/// Counts the pairs of triangles that meet elsewhere than in a shared node or edge. Precondition:
/// closed and manifold.
SelfIntersections find_self_intersections(const TriangleMesh& surface);

/// A surface that bounds one body: closed, manifold, wound outwards, the largest part only. Simple
/// faults are mended: nodes at the same place merged, degenerate and double triangles dropped,
/// triangles turned alike, holes narrower than a tenth of the body filled. `notes`, if given, gets
/// a line for what that changes of the body: holes filled, parts left out. Throws Error (counts of
/// border and non-manifold edges, a place in mm) where that is not enough.
TriangleMesh repair_surface(const TriangleMesh& surface, std::vector<std::string>* notes = nullptr);

/// Triangles of about the same size and shape over a repaired surface (M. Botsch and L. Kobbelt, A
/// Remeshing Approach to Multiresolution Modeling, 2004, as CGAL has it). Then all nodes are
/// shifted along their normals, as far as makes the volume that of the input (by at most 0.3
/// edges). The result is closed, manifold, free of self-intersections and wound outwards: where
/// `edge_length_m` is too coarse for that it is made smaller, up to `tries` times in all, and comes
/// back as what worked. Throws Error with the place in mm of what stayed wrong, or the surface's
/// box. Where `shorter_at` wants edges shorter than `edge_length_m`, they are so, in steps of a
/// factor of 0.7.
TriangleMesh remesh_surface(const TriangleMesh& surface, double& edge_length_m, int iterations,
                            int tries, const EdgeLengthField& shorter_at = {});

}  // namespace livetet
