#pragma once

#include <optional>

#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

/// Soft tissue with one or two families of fibres: the neo-Hookean material of young_Pa and poisson
/// and, for each family of direction a (a unit vector at rest),
///     k1 / (2 k2) (exp(k2 E^2) - 1)  where  E = kappa (I1 - 3) + (1 - 3 kappa) (I4 - 1) > 0,
/// I1 = |F|^2, I4 = |F a|^2. Fibres carry no compression: E <= 0 has no energy. kappa is their
/// dispersion: 0 all along a, 1/3 isotropic. The invariants are those of F itself, not of its part
/// that keeps the volume, which would let fibres swell the body (Nolan et al. 2014) and is not
/// finite at J = 0.
///
/// Beyond k2 E^2 = 10, far above what tissue bears, the exponential is continued by its Taylor
/// polynomial of second order, so that the energy is finite for any F. It is convex in E and E in
/// F, so that the fibres' tangent is never negative.
///
/// Sources: Holzapfel, Gasser and Ogden (2000), J. Elasticity 61 (the default numbers: media of a
/// rabbit's carotid artery); Gasser, Ogden and Holzapfel (2006), J. R. Soc. Interface 3
/// (dispersion); Nolan, Gower, Destrade, Ogden and McGarry (2014), J. Mech. Behav. Biomed. Mater.
/// 39.
class HolzapfelGasserOgden final : public ConstitutiveModel {
  public:
    double k1_Pa = 2363.2;
    double k2 = 0.8393;
    double dispersion = 0;             ///< kappa, from 0 to 1/3
    Eigen::Vector3d fibre_1{1, 0, 0};  ///< RAS, of any length but 0
    std::optional<Eigen::Vector3d> fibre_2{};

    Names names() const override;
    std::unique_ptr<ConstitutiveModel> clone() const override {
        return std::make_unique<HolzapfelGasserOgden>(*this);
    }
    void visit_keys(FieldVisitor& v) override;
    bool is_isotropic() const override { return false; }
    bool recovers_from_inversion(bool quadratic) const override { return !quadratic; }

    double shear_energy(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3& R) const override;
    Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                   const Matrix3& dF) const override;
    Matrix9 shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const override;
};

}  // namespace livetet
