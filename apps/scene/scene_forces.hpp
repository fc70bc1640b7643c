#pragma once

#include <vector>

#include "apps/scene/scene.hpp"
#include "solvers/parallel/mesh_part.hpp"

namespace livetet {

/// Gravity and loads of the scene as forces on local nodes, N; empty if it has neither. Collective.
std::vector<Vector3> scene_forces(const Scene& scene, const MeshPart& part);

}  // namespace livetet
