#include "mechanics/materials/constitutive_model.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>

#include <stdexcept>

#include "mechanics/materials/kinematics.hpp"

namespace livetet {

Matrix9 ConstitutiveModel::shear_tangent(double mu, double p, const Matrix3& H,
                                         Tangent tangent) const {
    if (kinematics() == Kinematics::corotated)
        throw std::logic_error(
            fmt::format("{}: a corotated model must override shear_tangent", name()));
    Matrix9 A;
    for (int k = 0; k < 9; ++k) {
        Matrix3 unit = Matrix3::Zero();
        unit.data()[k] = 1;
        Eigen::Map<Matrix3>(A.col(k).data()) =
            shear_stress_increment(mu, p, H, Matrix3::Identity(), unit);
    }
    if (tangent == Tangent::exact) return A;
    const Eigen::SelfAdjointEigenSolver<Matrix9> eigen(A);
    if (eigen.eigenvalues()[0] >= 0) return A;
    return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
           eigen.eigenvectors().transpose();
}

Eigen::Matrix3d ConstitutiveModel::bounded_increment(double lambda, double mu, const Matrix3& H,
                                                     const Matrix3& R, const Matrix3& dF) const {
    const Matrix3 N = volume_strain_gradient(H, R);
    return shear_stress_increment(mu, lambda * volume_strain(H, R), H, R, dF) +
           lambda * N.cwiseProduct(dF).sum() * N;
}

double ConstitutiveModel::volume_strain(const Matrix3& H, const Matrix3&) const {
    return dilation_of(H);
}

Eigen::Matrix3d ConstitutiveModel::volume_strain_gradient(const Matrix3& H, const Matrix3&) const {
    return cofactor_of(deformation_gradient(H));
}

}  // namespace livetet
