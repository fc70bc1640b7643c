#pragma once

#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

/// St Venant-Kirchhoff: Hooke's law of Green's strain E = (F^T F - I) / 2,
///     psi = mu |E|^2 + lambda / 2 (tr E)^2.
/// The compressive force peaks at a stretch of 1 / sqrt 3. E is the same for an element and its
/// mirror image.
class Green final : public ConstitutiveModel {
  public:
    Names names() const override;
    std::unique_ptr<ConstitutiveModel> clone() const override {
        return std::make_unique<Green>(*this);
    }
    bool resists_collapse() const override { return false; }
    bool recovers_from_inversion(bool) const override { return false; }

    const BatchLaw* batch_law() const override;
    double shear_energy(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                   const Matrix3& dF) const override;
    Matrix9 shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const override;
    double volume_strain(const Matrix3& H, const Matrix3& R) const override;
    Matrix3 volume_strain_gradient(const Matrix3& H, const Matrix3& R) const override;
};

}  // namespace livetet
