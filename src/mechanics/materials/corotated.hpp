#pragma once

#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

/// Small strain in the frame of R = rotation_of(F), which turns with the element:
///     psi = mu |F - R|^2 + lambda / 2 (tr R^T F - 3)^2.
/// Source: Mueller and Gross (2004), "Interactive virtual materials".
class Corotated final : public ConstitutiveModel {
  public:
    /// Sum of two of F's singular values (signed: negative in an inverted element) below which the
    /// tangent leaves out their turn against each other, whose derivative grows without bound.
    static constexpr double min_turned_stretch = 0.05;

    Names names() const override;
    std::unique_ptr<ConstitutiveModel> clone() const override {
        return std::make_unique<Corotated>(*this);
    }
    bool is_hooke_by_rotation() const override { return true; }
    Kinematics kinematics() const override { return Kinematics::corotated; }
    /// A tet of ten nodes can be in equilibrium with an inverted corner.
    bool recovers_from_inversion(bool quadratic) const override { return !quadratic; }

    double shear_energy(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                   const Matrix3& dF) const override;
    Matrix3 turn_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                           const Matrix3& dF) const override;
    Matrix9 shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const override;
    double volume_strain(const Matrix3& H, const Matrix3& R) const override;
    Matrix3 volume_strain_gradient(const Matrix3& H, const Matrix3& R) const override;
};

}  // namespace livetet
