#pragma once

#include <Eigen/Core>

#include <memory>
#include <string_view>

#include "config/fields.hpp"

namespace livetet {

class BatchLaw;

using Matrix9 = Eigen::Matrix<double, 9, 9>;

/// Which derivative of the stress an operator is made of. `frozen_rotation`: R K R^T, always
/// positive semi-definite (small strain and corotated; the other models have none and take
/// `positive`). `exact`: the second derivative of the energy. `positive`: the exact one with its
/// negative eigenvalues, of each quadrature point, set to zero.
enum class Tangent { frozen_rotation, exact, positive };

/// Rotation R passed to a model. `small_strain`: the identity, and the stress is linear in F.
/// `corotated`: rotation_of(F), and the stress is linear in F for fixed R. `finite_strain`: not
/// used.
enum class Kinematics { small_strain, corotated, finite_strain };

/// A hyperelastic material: its energy per rest volume (J/m^3), split into
///     psi(F) = psi_mu(F) + lambda / 2 theta(F)^2
/// so that one code serves the displacement form, where the pressure is p = lambda theta, and the
/// mixed form, where p is a field of its own (psi_mu + p theta - p^2 / (2 lambda)). lambda and mu
/// are Lame's moduli of the region, by which an isotropic model is Hooke's law near F = I; what
/// else a model needs are members of its own, which `visit_keys` names.
///
/// All functions take H = F - I, the gradient of the displacement, so that small strains keep their
/// digits, and are called at each quadrature point from any thread. They must be finite for any
/// finite F, inverted ones too: J = det F may be negative.
///
/// A model is a class derived from this one and a line in registry.cpp, or a call of
/// register_material. Users name it by `name` in a scene.
class ConstitutiveModel {
  public:
    using Matrix3 = Eigen::Matrix3d;

    virtual ~ConstitutiveModel() = default;

    /// The name in a scene, the name in tables and pictures, and what it is in a few words.
    struct Names {
        std::string_view name, title, meaning;
    };
    virtual Names names() const = 0;
    std::string_view name() const { return names().name; }

    virtual std::unique_ptr<ConstitutiveModel> clone() const = 0;

    /// Visits the scene's keys for the members of this model: key, value, unit, meaning, check.
    virtual void visit_keys(FieldVisitor&) {}

    virtual Kinematics kinematics() const { return Kinematics::finite_strain; }

    /// Whether psi is Hooke's law of the strain sym(R^T F) - I at any F, which is what the kernels
    /// over batches of tets compute (batch_kernels.hpp), and the blocks of
    /// Tangent::frozen_rotation.
    virtual bool is_hooke_by_rotation() const { return false; }

    /// The same model over batches of tets, for live frames; null: none is written, and a live
    /// frame calls the functions below for one tet after the other, which takes about ten times as
    /// long. For models that have no parameters but lambda and mu.
    virtual const BatchLaw* batch_law() const { return nullptr; }

    /// Whether it is Hooke's law of lambda and mu at small strain.
    virtual bool is_isotropic() const { return true; }

    /// Whether its energy is convex in uniaxial compression down to flat tets and grows beyond.
    virtual bool resists_collapse() const { return true; }

    /// Whether a body that starts flat, inverted or at random is claimed to come back to
    /// rest, of tets with four or with ten nodes (`quadratic`).
    virtual bool recovers_from_inversion([[maybe_unused]] bool quadratic) const { return true; }

    /// psi_mu, J/m^3.
    virtual double shear_energy(double mu, const Matrix3& H, const Matrix3& R) const = 0;

    /// d psi_mu / dF: the first Piola-Kirchhoff stress without its volumetric part, Pa.
    virtual Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3& R) const = 0;

    /// (d^2 psi_mu / dF^2 + p d^2 theta / dF^2) : dF with the rotation held, Pa.
    virtual Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                           const Matrix3& dF) const = 0;

    /// The derivative of the stress in the displacement form, rotations held, as a live frame takes
    /// it: (d^2 psi_mu / dF^2 + p d^2 theta / dF^2) : dF + lambda (d theta / dF : dF) d theta / dF
    /// with p = lambda theta, Pa. A model may bound what makes it indefinite. A frame makes one
    /// step of Newton's method and has no time for a line search; a step along an indefinite
    /// derivative can press elements through inversion, from which they do not come back.
    virtual Matrix3 bounded_increment(double lambda, double mu, const Matrix3& H, const Matrix3& R,
                                      const Matrix3& dF) const;
    /// Whether it does, or is positive without.
    virtual bool is_bounded() const { return kinematics() != Kinematics::finite_strain; }

    /// What the rotation's own derivative adds to `shear_stress_increment`, Pa, where a pressure p
    /// acts on theta: the sum is the exact derivative. Nothing, unless a model rotates.
    virtual Matrix3 turn_increment([[maybe_unused]] double mu, [[maybe_unused]] double p,
                                   const Matrix3& /*H*/, const Matrix3& /*R*/,
                                   const Matrix3& /*dF*/) const {
        return Matrix3::Zero();
    }

    /// d^2 psi_mu / dF^2 + p d^2 theta / dF^2 as a matrix on vec F (columns stacked), Pa, with the
    /// rotation's derivative; without its negative eigenvalues unless `tangent` is `exact`. This
    /// one is for finite strain: nine increments and an eigenvalue problem of nine unknowns. A
    /// model whose eigenvalues are known does better. A corotated model must override it.
    virtual Matrix9 shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const;

    /// theta; J - 1 unless a model has another.
    virtual double volume_strain(const Matrix3& H, const Matrix3& R) const;

    /// d theta / dF.
    virtual Matrix3 volume_strain_gradient(const Matrix3& H, const Matrix3& R) const;

    /// First Piola-Kirchhoff stress with a pressure p (positive in tension), Pa.
    Matrix3 stress(double mu, double p, const Matrix3& H, const Matrix3& R) const {
        return shear_stress(mu, H, R) + p * volume_strain_gradient(H, R);
    }
};

}  // namespace livetet
