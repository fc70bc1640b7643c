#pragma once

#include <filesystem>
#include <vector>

#include "mechanics/constraints.hpp"
#include "mesh/tet_mesh.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// The displacement, m, of each node of `mesh` in the last frame of a result of `solve` or
/// `register --deform`: of the same nodes, or of the same tets with or without nodes on their
/// edges. Throws Error, naming the file, if the result holds no equilibrium, did not converge, or
/// is of another mesh.
std::vector<Vector3> read_start(const std::filesystem::path& result, const TetMesh& mesh);

/// Displaces the body and holds it there: the external force becomes, with f the elastic force by
/// the body's own law and r the reactions of constraints and springs,
///
///     f_ext = f(u) - r(u),
///
/// so that u is an equilibrium while constraints and springs stay as they are. Throws Error if the
/// body has pressures at the corners of tets, whose values u does not tell, or if u differs from
/// what `constraints` prescribe by more than 0.1 mm.
void hold_at(DeformableBody& body, const Constraints& constraints, std::span<const Vector3> u);

}  // namespace livetet
