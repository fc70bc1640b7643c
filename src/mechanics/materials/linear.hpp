#pragma once

#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

/// Small strain, small rotation: Hooke's law of eps = sym F - I,
///     psi = mu |eps|^2 + lambda / 2 (tr eps)^2.
class Linear final : public ConstitutiveModel {
  public:
    Names names() const override;
    std::unique_ptr<ConstitutiveModel> clone() const override {
        return std::make_unique<Linear>(*this);
    }
    bool is_hooke_by_rotation() const override { return true; }
    Kinematics kinematics() const override { return Kinematics::small_strain; }

    double shear_energy(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                   const Matrix3& dF) const override;
    Matrix9 shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const override;
    double volume_strain(const Matrix3& H, const Matrix3& R) const override;
    Matrix3 volume_strain_gradient(const Matrix3& H, const Matrix3& R) const override;
};

}  // namespace livetet
