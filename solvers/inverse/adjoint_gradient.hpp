#pragma once

#include "solvers/inverse/force_basis.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// Gradient of phi(u(p)) by the coefficients p of the forces, where u(p) is the equilibrium of
/// `body` under f = B p:
///
///     f_int(u) = B p   =>   K du/dp = B   =>   d phi / d p = B^T lambda,   K lambda = d phi / d u.
///
/// One linear solve with the tangent K, which is symmetric, whatever the number of coefficients.
/// The body must be at its equilibrium and linearised there (DeformableBody::linearise).
/// `by_displacement`: d phi / d u at each node. Throws Error if the solve fails. Collective.
Eigen::VectorXd adjoint_gradient(DeformableBody& body, const ForceBasis& basis,
                                 std::span<const Vector3> by_displacement,
                                 double relative_tolerance);

}  // namespace livetet
