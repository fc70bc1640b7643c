#pragma once

#include <Eigen/Dense>

#include "mechanics/material.hpp"
#include "mechanics/rotation.hpp"

namespace livetet {

using Matrix9 = Eigen::Matrix<double, 9, 9>;

/// Sum of two of F's singular values (signed: negative in an inverted element) below which a
/// corotated tangent leaves out their turn against each other, which has no end to it there.
constexpr double least_turned_stretch = 0.05;

/// The energy density of a strain model (J/m^3), split into
///     psi(F) = psi_mu(F) + lambda / 2 theta(F)^2
/// so that one code serves the displacement form, where the pressure is p = lambda theta, and the
/// mixed form, where p is a field of its own (psi_mu + p theta - p^2 / (2 lambda)). With J = det F,
/// E = (F^T F - I) / 2:
///     model        psi_mu                                            theta
///     linear       mu |sym F - I|^2                                  tr F - 3
///     corotated    mu |F - R|^2, R = rotation_of(F)                  tr R^T F - 3       (Mueller
///     and Gross 2004) green        mu |E|^2                                          tr E (St
///     Venant-Kirchhoff) neohookean   mu/2 (|F|^2 - 3) - mu (J - 1) + mu/2 (J - 1)^2    J - 1
/// The last is the form of Smith, de Goes and Kim (2018, "Stable neo-Hookean flesh simulation",
/// without the barrier): it is finite for any F, has its minimum at rest, and agrees with Hooke's
/// law there. `linear` and `corotated` are one formula in a rotation R that is given to each
/// function (linear: the identity); the two others do not look at R. All take H = F - I, the
/// gradient of the displacement, so that small strains keep their digits (a stress made of F alone
/// has an error of round-off times the modulus).
template <StrainModel model>
struct StrainEnergy {
    using Matrix3 = Eigen::Matrix3d;
    static constexpr bool rotates = model == StrainModel::linear || model == StrainModel::corotated;

    static Matrix3 cofactor(const Matrix3& F) {
        Matrix3 c;
        c << F.col(1).cross(F.col(2)), F.col(2).cross(F.col(0)), F.col(0).cross(F.col(1));
        return c;
    }
    static Matrix3 deformation(const Matrix3& H) { return Matrix3::Identity() + H; }
    /// det(I + H) - 1.
    static double dilation(const Matrix3& H) {
        return H.trace() + 0.5 * (H.trace() * H.trace() - (H * H).trace()) + H.determinant();
    }
    /// R^T F + F^T R - 2 I, twice the strain of `linear` and `corotated`.
    static Matrix3 turned_strain(const Matrix3& H, const Matrix3& R) {
        if constexpr (model == StrainModel::linear) return H + H.transpose();
        const Matrix3 S = R.transpose() * deformation(H);
        return S + S.transpose() - 2 * Matrix3::Identity();
    }
    /// F^T F - I, twice Green's strain.
    static Matrix3 green_strain(const Matrix3& H) { return H + H.transpose() + H.transpose() * H; }

    /// theta.
    static double volume_strain(const Matrix3& H, const Matrix3& R) {
        if constexpr (model == StrainModel::linear) return H.trace();
        if constexpr (model == StrainModel::corotated)
            return R.cwiseProduct(deformation(H)).sum() - 3;
        if constexpr (model == StrainModel::green) return green_strain(H).trace() / 2;
        return dilation(H);
    }

    /// d theta / dF.
    static Matrix3 volume_strain_gradient(const Matrix3& H, const Matrix3& R) {
        if constexpr (rotates) return R;
        if constexpr (model == StrainModel::green) return deformation(H);
        return cofactor(deformation(H));
    }

    /// psi_mu.
    static double shear_energy(double mu, const Matrix3& H, const Matrix3& R) {
        if constexpr (rotates) return mu / 4 * turned_strain(H, R).squaredNorm();
        if constexpr (model == StrainModel::green) return mu / 4 * green_strain(H).squaredNorm();
        // |F|^2 - 3 - 2 (J - 1): the first orders cancel.
        const double J1 = dilation(H);
        const double rest =
            H.squaredNorm() - (H.trace() * H.trace() - (H * H).trace()) - 2 * H.determinant();
        return mu / 2 * (rest + J1 * J1);
    }

    /// d psi_mu / dF: the first Piola-Kirchhoff stress without its volumetric part, Pa.
    static Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3& R) {
        if constexpr (rotates) return mu * R * turned_strain(H, R);
        if constexpr (model == StrainModel::green) return mu * deformation(H) * green_strain(H);
        // F - cof F + (J - 1) cof F, with cof F = (1 + tr H) I - H^T + cof H.
        const Matrix3 first = H + H.transpose() - H.trace() * Matrix3::Identity() - cofactor(H);
        return mu * (first + dilation(H) * cofactor(deformation(H)));
    }

    /// First Piola-Kirchhoff stress with a pressure p (positive in tension), Pa.
    static Matrix3 stress(double mu, double p, const Matrix3& H, const Matrix3& R) {
        return shear_stress(mu, H, R) + p * volume_strain_gradient(H, R);
    }

    /// (d^2 psi_mu / dF^2 + p d^2 theta / dF^2) : dF, the rotation held.
    static Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                          const Matrix3& dF) {
        if constexpr (rotates) return mu * (dF + R * dF.transpose() * R);
        const Matrix3 F = deformation(H);
        if constexpr (model == StrainModel::green) {
            const Matrix3 FdF = F.transpose() * dF;
            return mu * (dF * green_strain(H) + F * (FdF + FdF.transpose())) + p * dF;
        }
        const Matrix3 N = cofactor(F);
        Matrix3 turned;  // the derivative of the cofactor
        for (int c = 0; c < 3; ++c) {
            const int d = (c + 1) % 3, e = (c + 2) % 3;
            turned.col(c) = F.col(d).cross(dF.col(e)) + dF.col(d).cross(F.col(e));
        }
        return mu * (dF + N.cwiseProduct(dF).sum() * N) + (mu * (dilation(H) - 1) + p) * turned;
    }

    /// d^2 psi_mu / dF^2 + p d^2 theta / dF^2 as a matrix on vec F (columns stacked), with the
    /// rotation's derivative. In the frame of F's singular vectors it falls into one 3x3 block
    /// (stretches) and, for each pair of axes, a symmetric and an antisymmetric mode, whose
    /// eigenvalues are known (Smith, de Goes and Kim 2019, "Analytic eigensystems for isotropic
    /// distortion energies"): `positive` cuts them at zero. Nearly singular modes (two singular
    /// values that all but cancel: an inverted element) are cut in `exact` too.
    static Matrix9 shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent);
};

extern template struct StrainEnergy<StrainModel::linear>;
extern template struct StrainEnergy<StrainModel::corotated>;
extern template struct StrainEnergy<StrainModel::green>;
extern template struct StrainEnergy<StrainModel::neohookean>;

/// visitor(StrainEnergy<model>{}) for a model known at run time.
template <class Visitor>
decltype(auto) with_energy(StrainModel model, Visitor&& visitor) {
    switch (model) {
        case StrainModel::linear:
            return visitor(StrainEnergy<StrainModel::linear>{});
        case StrainModel::green:
            return visitor(StrainEnergy<StrainModel::green>{});
        case StrainModel::neohookean:
            return visitor(StrainEnergy<StrainModel::neohookean>{});
        case StrainModel::corotated:
            break;
    }
    return visitor(StrainEnergy<StrainModel::corotated>{});
}

/// Whether a body of this model that starts flat, turned inside out or at random is claimed to come
/// back to rest. Green's strain cannot tell an element from its mirror image; a corotated tet of
/// ten nodes can rest with a corner inside out.
inline bool recovers_from_inversion(StrainModel model, bool quadratic) {
    if (model == StrainModel::green) return false;
    return model != StrainModel::corotated || !quadratic;
}

}  // namespace livetet
