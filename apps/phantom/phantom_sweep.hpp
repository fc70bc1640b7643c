#pragma once

#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// How a stylus is led over an organ that is seen from above (+z of the image).
struct SweepPath {
    double row_m = 0.010;   ///< distance of the rows, which run along x
    double step_m = 0.004;  ///< distance of successive places along a row
    double min_up = 0.4;    ///< least z of the unit normal where the tip reaches the surface
    double lift_m = 0.030;  ///< height of the way over what is left out
};

/// Places of the tip, m, one a sample: to and fro in rows over the upper side of a closed surface,
/// and through the air over steep places. Throws Error if it reaches no place.
std::vector<Vector3> sweep_path(const TriangleMesh& surface, const SweepPath& path);

}  // namespace livetet
