#pragma once

#include <span>
#include <vector>

#include "mechanics/material.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The body's weight as forces at its nodes, N: f_a = integral of N_a rho g over the body, one
/// entry a node, for P1 and P2 meshes alike. `gravity`: m/s^2. Throws Error where a region of the
/// mesh has no material.
std::vector<Vector3> gravity_load(const TetMesh& mesh, std::span<const Material> materials,
                                  const Vector3& gravity);

}  // namespace livetet
