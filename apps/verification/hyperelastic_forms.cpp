#include "apps/verification/hyperelastic_forms.hpp"

#include <cmath>

namespace livetet::verification {

namespace {

/// The root of a growing function, by bisection.
double root(const std::function<double(double)>& f) {
    double low = 0.1, high = 3;
    for (int halving = 0; halving < 100; ++halving) {
        const double middle = (low + high) / 2;
        (f(middle) < 0 ? low : high) = middle;
    }
    return (low + high) / 2;
}

/// dJ / dl_i.
Vector3 volume_gradient(const Vector3& l) { return {l.y() * l.z(), l.z() * l.x(), l.x() * l.y()}; }

}  // namespace

PrincipalStress mooney_rivlin(const Isotropic& m, double share) {
    const double c01 = share * m.mu() / 2, c10 = m.mu() / 2 - c01;
    return [=](const Vector3& l) -> Vector3 {
        const Vector3 squares = l.cwiseAbs2();
        const Vector3 others = Vector3::Constant(squares.sum()) - squares;
        const double of_J =
            -2 * c10 - 4 * c01 + (2 * c10 + m.lambda()) * (l.x() * l.y() * l.z() - 1);
        return 2 * c10 * l + 2 * c01 * l.cwiseProduct(others) + of_J * volume_gradient(l);
    };
}

PrincipalStress holzapfel_gasser_ogden(const Isotropic& m, const Fibres& f) {
    return [=](const Vector3& l) -> Vector3 {
        const double of_J = -m.mu() + (m.mu() + m.lambda()) * (l.x() * l.y() * l.z() - 1);
        Vector3 P = m.mu() * l + of_J * volume_gradient(l);
        const double along = 1 - 3 * f.dispersion;
        const double E = f.dispersion * (l.squaredNorm() - 3) + along * (l.x() * l.x() - 1);
        if (E > 0)
            P += 2 * f.k1 * E * std::exp(f.k2 * E * E) *
                 (f.dispersion * l + along * Vector3(l.x(), 0, 0));
        return P;
    };
}

FreeState uniaxial(const PrincipalStress& stress, double l) {
    const double t = root([&](double side) { return stress({l, side, side}).y(); });
    return {stress({l, t, t}).x(), t};
}

FreeState equibiaxial(const PrincipalStress& stress, double l) {
    const double t = root([&](double side) { return stress({l, l, side}).z(); });
    return {stress({l, l, t}).x(), t};
}

double incompressible_uniaxial(double c10, double c01, double l) {
    return 2 * (l - std::pow(l, -2)) * (c10 + c01 / l);
}

double incompressible_equibiaxial(double c10, double c01, double l) {
    return 2 * (l - std::pow(l, -5)) * (c10 + c01 * l * l);
}

Matrix3d mooney_rivlin_shear(const Isotropic& m, double share, double g) {
    Matrix3d stress = Matrix3d::Zero();
    stress(0, 0) = m.mu() * g * g;
    stress(0, 1) = stress(1, 0) = m.mu() * g;
    stress(2, 2) = share * m.mu() * g * g;
    return stress;
}

}  // namespace livetet::verification
