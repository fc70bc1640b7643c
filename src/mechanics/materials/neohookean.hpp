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

    /// On ten nodes it may rest everted: rounding decides.
    bool recovers_from_inversion(bool quadratic) const override { return !quadratic; }
    const BatchLaw* batch_law() const override;
    double shear_energy(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                   const Matrix3& dF) const override;
    /// With k = lambda + mu and N = cof F, the derivative of the stress is
    ///     dP = mu dF + k (N : dF) N + c dN,   c = k (J - 1) - mu.
    /// The last term's eigenvalues are c times those of d^2 J / dF^2: +- s_i, with s_i the
    /// stretches, for the shears between the two other axes. Where a tet is pressed, k (J - 1) is a
    /// multiple of -mu, and they outweigh mu. So c is held within +- mu / s, with s^2 the largest
    /// sum of a row of |F^T F|, which is not below the largest s_i^2 (Gershgorin). At F = I that
    /// changes nothing. Negative eigenvalues may stay in the flattest tets alone, small against mu
    /// (test NeoHookean.BoundedIncrementIsAllButPositive).
    Matrix3 bounded_increment(double lambda, double mu, const Matrix3& H, const Matrix3& R,
                              const Matrix3& dF) const override;
    bool is_bounded() const override { return true; }
    Matrix9 shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const override;
};

}  // namespace livetet
