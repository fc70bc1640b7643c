#pragma once

#include "mechanics/tet_kernels.hpp"

/// The corotated P1 tet one at a time, in the plainest form: what the batch kernels are judged and
/// measured against.
namespace livetet::test {

/// grad u = sum_i u_i g_i^T; u.col(i) is node i's value.
inline Eigen::Matrix3d gradient_of(const TetElement& e, const Eigen::Matrix<double, 3, 4>& u) {
    return u * e.gradients.transpose();
}

/// dP = mu (dF + R dF^T R) + lambda tr(R^T dF) R, the rotation R held, Pa.
inline Eigen::Matrix3d stress_increment(const TetElement& e, const Eigen::Matrix3d& R,
                                        const Eigen::Matrix3d& dF) {
    return e.mu * (dF + R * dF.transpose() * R) + e.lambda * R.cwiseProduct(dF).sum() * R;
}

/// P = R (2 mu eps + lambda tr(eps) I), eps = sym(R^T F) - I, Pa.
inline Eigen::Matrix3d first_piola(const TetElement& e, const Eigen::Matrix3d& R,
                                   const Eigen::Matrix3d& F) {
    return stress_increment(e, R, F) - (2 * e.mu + 3 * e.lambda) * R;
}

/// f.col(i) = V P g_i, N.
inline Eigen::Matrix<double, 3, 4> nodal_forces(const TetElement& e, const Eigen::Matrix3d& P) {
    return e.volume * (P * e.gradients);
}

/// K_ij = V (lambda h_i h_j^T + mu h_j h_i^T + mu (h_i . h_j) I), h = R g, N/m.
inline Eigen::Matrix3d stiffness_block(const TetElement& e, const Eigen::Vector3d& h_i,
                                       const Eigen::Vector3d& h_j) {
    return shear_block(e.volume * e.mu, h_i, h_j) + e.volume * e.lambda * h_i * h_j.transpose();
}

}  // namespace livetet::test
