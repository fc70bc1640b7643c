#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mesh/hierarchy.hpp"

namespace livetet {

/// A body that is not a block, for `bench convergence`. Lengths in m.
struct ConvergenceBody {
    std::string name;
    std::function<bool(const Vector3&)> contains;
    Vector3 low, high;     ///< corners of a box around it
    double voxel_m = 0;    ///< of the label image that it is meshed from
    std::string boundary;  ///< lines of a scene: what is fixed, and the load
};

/// An organ, a tree of vessels, a thin curved wall, and a block with holes.
const std::vector<ConvergenceBody>& convergence_bodies();

/// Meshes a body through its label image, with coarser levels. `nodes`: about those of the finest
/// level. Throws Error if that cannot be made.
MeshHierarchy mesh_body(const ConvergenceBody& body, double nodes);

}  // namespace livetet
