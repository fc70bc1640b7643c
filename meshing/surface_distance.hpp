#pragma once

#include "geometry/nearest_triangle.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// How far a surface lies from another, metres.
struct SurfaceDistance {
    double max_m = 0;                    ///< one-sided Hausdorff distance, of the points tried
    double mean_m = 0;                   ///< by area
    Vector3 farthest = Vector3::Zero();  ///< the point of the surface where it is greatest
};

/// From `surface` to `other`, taken at the centres of n^2 equal pieces of each triangle, n so great
/// that their edges are at most `spacing_m`, but no greater than 20: the maximum misses less than
/// `spacing_m`, or than a twentieth of the longest edge where that is more. On all cores.
SurfaceDistance distance_between(const TriangleMesh& surface, const NearestTriangle& other,
                                 double spacing_m);

/// Both directions.
struct HausdorffDistance {
    SurfaceDistance to_body, from_body;
};

/// Between a level's boundary and the surface that it stands for.
HausdorffDistance hausdorff_distance(const TriangleMesh& level, const TriangleMesh& body,
                                     const NearestTriangle& tree);

}  // namespace livetet
