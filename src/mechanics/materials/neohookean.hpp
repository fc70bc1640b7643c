#pragma once

#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

/// Neo-Hookean rubber and tissue:
///     psi = mu / 2 (|F|^2 - 3) - mu (J - 1) + (lambda + mu) / 2 (J - 1)^2,
/// of which psi_mu has mu / 2 (J - 1)^2 and theta = J - 1. Finite for any F, with its minimum at
/// rest and Hooke's law there. Source: Smith, de Goes and Kim (2018), "Stable neo-Hookean flesh
/// simulation", without the barrier.
class NeoHookean final : public ConstitutiveModel {
  public:
    Names names() const override;
    std::unique_ptr<ConstitutiveModel> clone() const override {
        return std::make_unique<NeoHookean>(*this);
    }

    const BatchLaw* batch_law() const override;
    double shear_energy(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                   const Matrix3& dF) const override;
    Matrix9 shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const override;
};

}  // namespace livetet
