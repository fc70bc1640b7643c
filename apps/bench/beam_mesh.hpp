#pragma once

#include "base/progress.hpp"
#include "mesh/hierarchy.hpp"

namespace livetet {

/// Meshes the box 0.2 x 0.1 x 0.1 m: on each level a surface of triangles of its size, filled by
/// Gmsh. `edge_m`: of the finest level.
MeshHierarchy mesh_beam(double edge_m, const ProgressCallback& progress);

}  // namespace livetet
