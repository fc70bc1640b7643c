#include "mechanics/materials/linear.hpp"

namespace livetet {

ConstitutiveModel::Names Linear::names() const {
    return {"linear", "linear", "small strain, small rotation: cheapest"};
}

double Linear::volume_strain(const Matrix3& H, const Matrix3&) const { return H.trace(); }

Eigen::Matrix3d Linear::volume_strain_gradient(const Matrix3&, const Matrix3& R) const { return R; }

double Linear::shear_energy(double mu, const Matrix3& H, const Matrix3&) const {
    return mu / 4 * (H + H.transpose()).squaredNorm();
}

Eigen::Matrix3d Linear::shear_stress(double mu, const Matrix3& H, const Matrix3&) const {
    return mu * (H + H.transpose());
}

Eigen::Matrix3d Linear::shear_stress_increment(double mu, double, const Matrix3&, const Matrix3&,
                                               const Matrix3& dF) const {
    return mu * (dF + dF.transpose());
}

Matrix9 Linear::shear_tangent(double mu, double, const Matrix3&, Tangent) const {
    Matrix9 A = mu * Matrix9::Identity();
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) A(3 * b + a, 3 * a + b) += mu;
    return A;
}

}  // namespace livetet
