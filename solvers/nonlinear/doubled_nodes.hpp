#pragma once

#include "mesh/opened_nodes.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// Takes the state of a body over to one whose mesh has the same cells after a cut has opened, and
/// what its frames have learned. A copy has its original's displacement, velocity, acceleration and
/// pressure, a node that moved those of its new place; a hexahedron keeps its pressure. Of
/// generalized-alpha's forces at the last step's end each node takes the force per mass of its
/// original. For bodies on one rank, of the same scheme and form; of hexahedra, `to` may also
/// eliminate the pressures; of ten-node tets neither has any. Throws Error if they do not belong
/// together; then `to` may be changed.
void carry_state(DeformableBody& from, DeformableBody& to, const OpenedNodes& nodes);

}  // namespace livetet
