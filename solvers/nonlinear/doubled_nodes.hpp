#pragma once

#include <cstdint>
#include <span>

#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// Takes the state of a body over to one whose mesh has the same cells and further nodes, which
/// are copies: of each, `originals` has the node that it is a copy of, with a lower number. A copy
/// has its original's displacement, velocity and acceleration. Of generalized-alpha's forces at the
/// last step's end each node takes the force per mass of its original. For bodies on one rank of
/// the same scheme and form. Throws Error if they do not belong together; then `to` may be changed.
void carry_state(DeformableBody& from, DeformableBody& to, std::span<const std::int32_t> originals);

}  // namespace livetet
