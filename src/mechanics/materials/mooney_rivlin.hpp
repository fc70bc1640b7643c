#pragma once

#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

/// Mooney-Rivlin rubber: with I1 = |F|^2 and I2 = |cof F|^2, the invariants of F^T F,
///     psi = c10 (I1 - 3 - 2 (J - 1) + (J - 1)^2) + c01 (I2 - 3 - 4 (J - 1))
///           + lambda / 2 (J - 1)^2,
/// mu = 2 (c10 + c01), theta = J - 1. The terms in J make rest free of stress and Hooke's law hold
/// there; where J = 1 it is Mooney's energy c10 (I1 - 3) + c01 (I2 - 3) itself. Polynomial, so
/// finite for any F; both brackets are polyconvex and at least 0, and 0 for rotations only.
/// Sources: Mooney (1940), Rivlin (1948); polyconvexity: Ball (1977).
class MooneyRivlin final : public ConstitutiveModel {
  public:
    double c01_share = 0.2;  ///< c01 / (c10 + c01); 0: neo-Hookean

    Names names() const override;
    std::unique_ptr<ConstitutiveModel> clone() const override {
        return std::make_unique<MooneyRivlin>(*this);
    }
    /// Ten-node tets turned inside out come back in some runs and not in others: rounding decides.
    bool recovers_from_inversion(bool quadratic) const override { return !quadratic; }
    void visit_keys(FieldVisitor& v) override;

    double shear_energy(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                   const Matrix3& dF) const override;
    Matrix9 shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const override;
};

}  // namespace livetet
