#pragma once

#include <cstddef>
#include <vector>

#include "mesh/tet_mesh.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

/// A place on a surface, m, and the unit normal out of it, the mean within 15 mm.
struct SurfacePlace {
    Vector3 place, normal;
};

/// The place that is seen from `centre` in a direction.
SurfacePlace place_towards(const TriangleMesh& surface, const Vector3& centre,
                           const Vector3& direction);

/// Where targets are looked for, and how many.
struct TargetPlaces {
    double deep = 0.008;  ///< least distance from the surface, m
    double near = 0.07;   ///< largest distance from the place, m
    std::size_t count = 32;
};

/// Places inside a body, near one, as far from each other as can be (farthest-point sampling).
/// Throws Error if there are not so many.
std::vector<NamedPoint> targets_inside(const TetMesh& mesh, const Vector3& place,
                                       const TargetPlaces& wanted);

}  // namespace livetet
