#pragma once

#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Gravity and loads of the scene as nodal forces, N; empty if it has neither.
std::vector<Vector3> scene_forces(const Scene& scene, const TetMesh& mesh);

}  // namespace livetet
