#include "mechanics/materials/corotated.hpp"

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
