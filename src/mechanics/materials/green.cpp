#include "mechanics/materials/green.hpp"

#include "mechanics/materials/isotropic_tangent.hpp"
#include "mechanics/materials/kinematics.hpp"

namespace livetet {

ConstitutiveModel::Names Green::names() const {
    return {"green", "Green",
            "Green's strain (St Venant-Kirchhoff): large rotation, tension; softens and collapses "
            "in compression"};
}

double Green::volume_strain(const Matrix3& H, const Matrix3&) const {
    return twice_green_strain(H).trace() / 2;
}

Eigen::Matrix3d Green::volume_strain_gradient(const Matrix3& H, const Matrix3&) const {
    return deformation_gradient(H);
}

double Green::shear_energy(double mu, const Matrix3& H, const Matrix3&) const {
    return mu / 4 * twice_green_strain(H).squaredNorm();
}

Eigen::Matrix3d Green::shear_stress(double mu, const Matrix3& H, const Matrix3&) const {
    return mu * deformation_gradient(H) * twice_green_strain(H);
}

Eigen::Matrix3d Green::shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3&,
                                              const Matrix3& dF) const {
    const Matrix3 F = deformation_gradient(H), FdF = F.transpose() * dF;
    return mu * (dF * twice_green_strain(H) + F * (FdF + FdF.transpose())) + p * dF;
}

Matrix9 Green::shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const {
    const SignedSvd svd = signed_svd(deformation_gradient(H));
    PrincipalModes m;
    m.stretch = (3 * mu * svd.sigma.cwiseAbs2().array() - mu + p).matrix().asDiagonal();
    for (int k = 0; k < 3; ++k) {
        const double a = svd.sigma[(k + 1) % 3], b = svd.sigma[(k + 2) % 3];
        m.flip[k] = p - mu + mu * (a * a + b * b + a * b);
        m.twist[k] = p - mu + mu * (a * a + b * b - a * b);
    }
    return isotropic_tangent(svd, m, tangent);
}

}  // namespace livetet
