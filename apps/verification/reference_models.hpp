#pragma once

#include <Eigen/Core>

#include <functional>
#include <optional>

#include "apps/verification/closed_forms.hpp"

/// Elastic energies of finite strain, written anew to judge the project's own: slow, from an SVD,
/// without derivatives by hand beyond P. With homogeneous states that are known in closed form, and
/// a manufactured field for the order study.
namespace livetet::verification {

/// The energy per rest volume Psi(F), with Lame's mu and lambda; all four are Hooke's law near F =
/// I.
enum class ReferenceModel {
    linear,      ///< mu eps:eps + lambda/2 tr(eps)^2, eps = (F + F^T)/2 - I
    corotated,   ///< mu |F - R|^2 + lambda/2 tr(R^T F - I)^2, R the rotation nearest to F
    green,       ///< mu E:E + lambda/2 tr(E)^2, E = (F^T F - I)/2 (St Venant-Kirchhoff)
    neohookean,  ///< mu/2 (|F|^2 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2 (Smith, de Goes, Kim
                 ///< 2018, no barrier)
};

/// Psi(F), in energy per rest volume.
double energy_density(ReferenceModel model, const Isotropic& m, const Matrix3d& F);

/// P = dPsi/dF, the first Piola-Kirchhoff stress: P N is the force per rest area with the rest
/// normal N.
Matrix3d first_piola(ReferenceModel model, const Isotropic& m, const Matrix3d& F);

/// A bar pulled along x with free sides: F = diag(stretch, lateral, lateral), P = diag(P11, 0, 0).
struct Uniaxial {
    double P11, lateral;
};

/// In closed form; none where the sides would have to collapse (lateral^2 or lateral <= 0). With l
/// the stretch:
///   linear, corotated: P11 = E (l - 1), lateral = 1 - nu (l - 1);
///   green: P11 = E (l^3 - l) / 2, lateral^2 = 1 - nu (l^2 - 1);
///   neohookean: lateral^2 = (l + (1 - 2 nu) (l - 1)) / l^2, P11 from P: none for l <= (1 - 2 nu) /
///   (2 - 2 nu).
std::optional<Uniaxial> uniaxial(ReferenceModel model, const Isotropic& m, double stretch);

/// P of simple shear, F = I + g e1 e2^T, in closed form:
///   linear, neohookean: mu g (e1 e2^T + e2 e1^T);
///   corotated: 2 mu (F - R) + lambda (sqrt(4 + g^2) - 2) R, R the turn about z by -atan(g / 2);
///   green: E11 = E33 = 0, E22 = g^2 / 2, E12 = g / 2; P = F (2 mu E + lambda g^2 / 2 I).
Matrix3d simple_shear(ReferenceModel model, const Isotropic& m, double g);

/// A smooth displacement on and about the unit cube, three waves that share no symmetry:
///   u_i = amplitude sin(k_i . x + phase_i), k_i the rows of `waves`.
/// With the default amplitude |grad u| < 0.15, so any strain model is far from an inverted element.
struct ManufacturedField {
    double amplitude = 0.03;
    Matrix3d waves{{2.1, 1.3, -0.7}, {-1.1, 2.4, 0.9}, {0.6, -1.7, 2.2}};
    Vector3 phases{0.3, 1.1, -0.4};

    Vector3 displacement(const Vector3& x) const;
    /// (i, j): du_i / dx_j, so that F = I + gradient(x).
    Matrix3d gradient(const Vector3& x) const;
    /// The force per volume that holds u in linear elasticity: -(lambda + mu) grad div u - mu lap
    /// u, in closed form.
    Vector3 linear_body_force(const Isotropic& m, const Vector3& x) const;
    /// The force per rest volume that holds u where the stress is P(F): -Div P(I + grad u), by
    /// differences of eighth order of P at steps of 0.02, the gradient exact: to about 1e-11 of P's
    /// size.
    Vector3 body_force(const std::function<Matrix3d(const Matrix3d& F)>& P, const Vector3& x) const;
};

}  // namespace livetet::verification
