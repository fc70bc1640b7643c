#pragma once

#include <cstdint>
#include <vector>

#include "mesh/geodesic.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A connected piece of a mesh's surface.
struct SurfacePatch {
    std::vector<std::int32_t> nodes;  ///< sorted
    /// The point of the surface nearest to the given place; its triangle is one of
    /// boundary_triangles.
    SurfacePoint at;
    /// Corner nearest to the given place, of the triangle nearest to it.
    std::int32_t centre = -1;
    double distance = 0;                ///< distance from the place to that triangle, metres
    double area = 0;                    ///< about its nodes, m^2
    Vector3 normal = Vector3::UnitZ();  ///< mean over that area, outwards, of unit length
    /// From the place to the centroid of that area, along the surface, metres.
    Vector3 off_centre = Vector3::Zero();
};

/// The surface nodes within `radius` (metres) of the point of the surface nearest to `place`,
/// measured along the surface (see `distances_on_surface`), so that a patch on a thin rim does not
/// reach through to the other side. If there are none, the centre alone. The centre is chosen
/// through the triangle nearest to `place`: the nearest node could lie on the other side of a rim
/// thinner than an edge.
SurfacePatch surface_patch(const TetMesh& mesh, const Vector3& place, double radius);

}  // namespace livetet
