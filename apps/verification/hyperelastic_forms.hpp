#pragma once

#include <functional>

#include "apps/verification/closed_forms.hpp"

/// Mooney-Rivlin and Holzapfel-Gasser-Ogden materials by their principal stretches, written anew to
/// judge the project's own.
namespace livetet::verification {

/// P_i = dPsi / dl_i of the stretches l along the axes, where F = diag(l).
using PrincipalStress = std::function<Vector3(const Vector3& l)>;

/// Psi = c10 (I1 - 3) + c01 (I2 - 3) - (2 c10 + 4 c01) (J - 1) + (c10 + lambda / 2) (J - 1)^2 with
/// c01 = share mu / 2 and c10 + c01 = mu / 2; I1, I2 and J by the stretches.
PrincipalStress mooney_rivlin(const Isotropic& m, double share);

/// Constants of fibres along x.
struct Fibres {
    double k1 = 0.5, k2 = 0.8393, dispersion = 0;
};

/// Psi = mu / 2 (I1 - 3) - mu (J - 1) + (mu + lambda) / 2 (J - 1)^2
///       + k1 / (2 k2) (exp(k2 E^2) - 1) where E = kappa (I1 - 3) + (1 - 3 kappa) (l1^2 - 1) > 0.
PrincipalStress holzapfel_gasser_ogden(const Isotropic& m, const Fibres& fibres);

/// The stretch t of the free sides and the stress P11 that go with the stretch l: t from the free
/// sides' P = 0, by bisection between 0.3 and 3.
struct FreeState {
    double P11, lateral;
};
FreeState uniaxial(const PrincipalStress& stress, double l);     ///< F = diag(l, t, t)
FreeState equibiaxial(const PrincipalStress& stress, double l);  ///< F = diag(l, l, t)

/// P11 of an incompressible Mooney-Rivlin material, in closed form:
///   uniaxial: 2 (l - l^-2) (c10 + c01 / l);  equibiaxial: 2 (l - l^-5) (c10 + c01 l^2).
/// Source: Rivlin (1948); Treloar, The Physics of Rubber Elasticity (3rd edition), chapter 5.
double incompressible_uniaxial(double c10, double c01, double l);
double incompressible_equibiaxial(double c10, double c01, double l);

/// Cauchy stress of Mooney-Rivlin in simple shear F = I + g e1 e2^T, where J = 1 and the pressure
/// is 0: s12 = mu g, s11 = mu g^2, s22 = 0, s33 = 2 c01 g^2; s11 - s22 = g s12 is Rivlin's
/// universal relation.
Matrix3d mooney_rivlin_shear(const Isotropic& m, double share, double g);

}  // namespace livetet::verification
