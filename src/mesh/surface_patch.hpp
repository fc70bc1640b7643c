#pragma once

#include <cstdint>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A piece of a mesh's surface around a place.
struct SurfacePatch {
    std::vector<std::int32_t> nodes;  ///< sorted
    std::int32_t centre = -1;  ///< the corner nearest to the place of the triangle nearest to it
    double distance = 0;       ///< from the place to that triangle, metres
};

/// The surface nodes within `radius` (metres) of the patch's centre, measured along the surface's
/// edges (Dijkstra), so that a patch on a thin rim does not reach through to the other side. The
/// centre belongs to the triangle nearest to `place`: the nearest of all nodes may lie behind a rim
/// that is thinner than its edges are long.
SurfacePatch surface_patch(const TetMesh& mesh, const Vector3& place, double radius);

}  // namespace livetet
