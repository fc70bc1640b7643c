#pragma once

#include "geometry/nearest_triangle.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Distance of a surface from another, metres.
struct SurfaceDistance {
    /// One-sided Hausdorff distance: no point is farther away. Too large by 1 % at most, or by
    /// 1e-4 of the mean edge if that is more.
    double max_m = 0;
    double mean_m = 0;                   ///< mean over the area
    Vector3 farthest = Vector3::Zero();  ///< the point of the surface at the maximum
};

/// Distance from `surface` to `other`. The mean is that of samples at the centres of n^2 equal
/// pieces of each triangle, with n the smallest number for which the pieces' edges are at most
/// `spacing_m`, but at most 20. Uses all cores.
SurfaceDistance distance_between(const TriangleMesh& surface, const NearestTriangle& other,
                                 double spacing_m);

/// The distances in both directions.
struct HausdorffDistance {
    SurfaceDistance to_body, from_body;
};

/// Distance between a level's boundary and the surface that it represents.
HausdorffDistance hausdorff_distance(const TriangleMesh& level, const TriangleMesh& body,
                                     const NearestTriangle& tree);

}  // namespace livetet
