#pragma once

#include <vector>

#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// The force at each node, N, that holds a body at rest in its present displacement: the elastic
/// force less what constraints and springs put on their nodes. At constrained components it is the
/// external force that the body has. Pressures, if there are any, must belong to the displacement.
/// Collective.
inline std::vector<Vector3> held_force(DeformableBody& body) {
    std::vector<Vector3> force = body.elastic_force();
    const std::vector<Vector3> reactions = body.reactions();
    for (std::size_t n = 0; n < force.size(); ++n) force[n] -= reactions[n];
    return force;
}

}  // namespace livetet
