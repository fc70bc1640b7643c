#pragma once

#include "geometry/error_ellipsoid.hpp"
#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// An icosahedron's surface, divided twice: 162 nodes on the unit sphere, 320 triangles.
const TriangleMesh& unit_sphere_surface();

/// The ellipsoid about `centre` (m): the nodes of the unit sphere scaled by its semi-axes and
/// turned. It is inscribed, with 96.6 % of the ellipsoid's volume, and flat along semi-axes of 0.
TriangleMesh ellipsoid_surface(const Vector3& centre, const ErrorEllipsoid& ellipsoid);

}  // namespace livetet
