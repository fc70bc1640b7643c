#include "mechanics/materials/corotated.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "mechanics/materials/isotropic_tangent.hpp"
#include "mechanics/materials/kinematics.hpp"

namespace livetet {

namespace {

/// R^T F + F^T R - 2 I, twice the strain.
Eigen::Matrix3d twice_strain(const Eigen::Matrix3d& H, const Eigen::Matrix3d& R) {
    const Eigen::Matrix3d S = R.transpose() * deformation_gradient(H);
    return S + S.transpose() - 2 * Eigen::Matrix3d::Identity();
}

}  // namespace

ConstitutiveModel::Names Corotated::names() const {
    return {"corotated", "corotated", "small strain, any rotation"};
}

double Corotated::volume_strain(const Matrix3& H, const Matrix3& R) const {
    return R.cwiseProduct(deformation_gradient(H)).sum() - 3;
}

Eigen::Matrix3d Corotated::volume_strain_gradient(const Matrix3&, const Matrix3& R) const {
    return R;
}

double Corotated::shear_energy(double mu, const Matrix3& H, const Matrix3& R) const {
    return mu / 4 * twice_strain(H, R).squaredNorm();
}

Eigen::Matrix3d Corotated::shear_stress(double mu, const Matrix3& H, const Matrix3& R) const {
    return mu * R * twice_strain(H, R);
}

Eigen::Matrix3d Corotated::shear_stress_increment(double mu, double, const Matrix3&,
                                                  const Matrix3& R, const Matrix3& dF) const {
    return mu * (dF + R * dF.transpose() * R);
}

// With S = R^T F and M = R^T dF, R turns by dR = R [w]x, (tr S I - S) w = a, where [a]x = M - M^T.
// P = 2 mu (F - R) + p R, so that its exact derivative at a given p is 2 mu dF + (p - 2 mu) dR:
// mu R [a]x + (p - 2 mu) R [w]x more than with R held.
Eigen::Matrix3d Corotated::turn_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                          const Matrix3& dF) const {
    const Matrix3 RF = R.transpose() * deformation_gradient(H), S = (RF + RF.transpose()) / 2;
    const Matrix3 M = R.transpose() * dF;
    const Eigen::Vector3d a(M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1));
    // The eigenvalues of G are sums of two stretches.
    const Matrix3 G = S.trace() * Matrix3::Identity() - S;
    const Matrix3 above = G - min_turned_stretch * Matrix3::Identity();
    Eigen::Vector3d axis;
    if (above(0, 0) > 0 && above(0, 0) * above(1, 1) > above(0, 1) * above(0, 1) &&
        above.determinant() > 0) {
        axis = mu * a + (p - 2 * mu) * (G.inverse() * a);
    } else {
        const Eigen::SelfAdjointEigenSolver<Matrix3> modes(G);
        Eigen::Vector3d of_modes = modes.eigenvectors().transpose() * a;
        for (int k = 0; k < 3; ++k) {
            const double sum = modes.eigenvalues()[k];
            of_modes[k] *= sum > min_turned_stretch ? mu + (p - 2 * mu) / sum : 0;
        }
        axis = modes.eigenvectors() * of_modes;
    }
    Matrix3 turn;
    turn << 0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0;
    return R * turn;
}

Matrix9 Corotated::shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const {
    const SignedSvd svd = signed_svd(deformation_gradient(H));
    PrincipalModes m;
    m.stretch = 2 * mu * Matrix3::Identity();
    m.flip.setConstant(2 * mu);
    for (int k = 0; k < 3; ++k) {
        const double sum = svd.sigma.sum() - svd.sigma[k];
        m.twist[k] = sum > min_turned_stretch ? (2 * mu * (sum - 2) + 2 * p) / sum : 0;
    }
    return isotropic_tangent(svd, m, tangent);
}

}  // namespace livetet
