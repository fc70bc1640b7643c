#pragma once

#include <Eigen/Dense>

#include <array>

namespace livetet {

/// What a linear tetrahedron needs to know of its rest shape and material.
/// gradients.col(i): gradient of shape function i (1/m); they sum to zero. volume in m^3; lambda, mu in Pa.
struct TetElement {
    Eigen::Matrix<double, 3, 4> gradients;
    double volume;
    double lambda;
    double mu;
};

/// Gradients and volume of the tet x0..x3 (metres). Precondition: positive volume.
inline TetElement make_element(const std::array<Eigen::Vector3d, 4>& x, double lambda, double mu) {
    const Eigen::Vector3d a = x[1] - x[0], b = x[2] - x[0], c = x[3] - x[0];
    const double six_volumes = a.dot(b.cross(c));
    TetElement e{{}, six_volumes / 6, lambda, mu};
    e.gradients.col(1) = b.cross(c) / six_volumes;
    e.gradients.col(2) = c.cross(a) / six_volumes;
    e.gradients.col(3) = a.cross(b) / six_volumes;
    e.gradients.col(0) = -e.gradients.col(1) - e.gradients.col(2) - e.gradients.col(3);
    return e;
}

/// grad u = sum_i u_i g_i^T; u.col(i) is node i's value. F = I + grad u.
inline Eigen::Matrix3d gradient_of(const TetElement& e, const Eigen::Matrix<double, 3, 4>& u) {
    return u * e.gradients.transpose();
}

/// Derivative of the corotated stress in the direction H with the rotation R held:
/// dP = mu (H + R H^T R) + lambda tr(R^T H) R, in Pa.
inline Eigen::Matrix3d stress_increment(const TetElement& e, const Eigen::Matrix3d& R, const Eigen::Matrix3d& H) {
    const double trace = (R.array() * H.array()).sum();
    return e.mu * (H + R * H.transpose() * R) + e.lambda * trace * R;
}

/// First Piola-Kirchhoff stress of the corotated model, P = R (2 mu eps + lambda tr(eps) I) with
/// eps = sym(R^T F) - I (Mueller and Gross 2004). Where R is F's own rotation this is the derivative of the energy
/// density mu |F - R|^2 + lambda / 2 tr(R^T F - I)^2; with an R held from an earlier F it is linear in F. R = I is
/// the linear model.
inline Eigen::Matrix3d first_piola(const TetElement& e, const Eigen::Matrix3d& R, const Eigen::Matrix3d& F) {
    return stress_increment(e, R, F) - (2 * e.mu + 3 * e.lambda) * R;
}

/// Energy density mu |F - R|^2 + lambda / 2 tr(R^T F - I)^2, in J/m^3.
inline double corotated_energy_density(const TetElement& e, const Eigen::Matrix3d& R, const Eigen::Matrix3d& F) {
    const double trace = (R.array() * F.array()).sum() - 3;
    return e.mu * (F - R).squaredNorm() + e.lambda / 2 * trace * trace;
}

/// Nodal forces of a stress: f.col(i) = V P g_i, in N.
inline Eigen::Matrix<double, 3, 4> nodal_forces(const TetElement& e, const Eigen::Matrix3d& P) {
    return e.volume * (P * e.gradients);
}

/// One 3x3 block of R K R^T for an isotropic tet, from rotated gradients h_i = R g_i:
/// K_ij = V (lambda h_i h_j^T + mu h_j h_i^T + mu (h_i . h_j) I), in N/m.
inline Eigen::Matrix3d stiffness_block(const TetElement& e, const Eigen::Vector3d& h_i, const Eigen::Vector3d& h_j) {
    Eigen::Matrix3d K = e.volume * (e.lambda * h_i * h_j.transpose() + e.mu * h_j * h_i.transpose());
    K.diagonal().array() += e.volume * e.mu * h_i.dot(h_j);
    return K;
}

}  // namespace livetet
