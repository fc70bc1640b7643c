#pragma once

#include <cstdint>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A piece of a mesh's surface around a place.
struct SurfacePatch {
    std::vector<std::int32_t> nodes;  ///< sorted
    std::int32_t centre = -1;         ///< the surface node nearest to the place
    double distance = 0;              ///< from the place to it, metres
};

/// The surface nodes within `radius` (metres) of the surface node nearest to `place`, measured along the surface's
/// edges (Dijkstra), so that a patch on a thin rim does not reach through to the other side.
SurfacePatch surface_patch(const TetMesh& mesh, const Vector3& place, double radius);

}  // namespace livetet
