#include "mechanics/materials/green.hpp"

#include "mechanics/lane_law.hpp"
#include "mechanics/materials/isotropic_tangent.hpp"
#include "mechanics/materials/kinematics.hpp"

namespace livetet {

namespace {

/// With C = F^T F - I and S = mu C + lambda / 2 tr(C) I,
///     P = F S,   dP = F dS + dF S.
struct GreenInLanes {
    static constexpr bool rotates = false;
    using Number = lanes::Lanes<float>;
    using Matrix = lanes::Mat3<float>;

    static Matrix stress(const Number& lambda, const Number& mu, const Matrix& H, const Matrix&) {
        return lanes::plus_identity(H) * second_stress(lambda, mu, twice_strain(H));
    }
    static Matrix increment(const Number& lambda, const Number& mu, const Matrix& H, const Matrix&,
                            const Matrix& dF) {
        const Matrix F = lanes::plus_identity(H), FdF = lanes::transposed(F) * dF;
        return F * second_stress(lambda, mu, FdF + lanes::transposed(FdF)) +
               dF * second_stress(lambda, mu, twice_strain(H));
    }

    /// theta = tr(C) / 2.
    static Number volume_strain(const Matrix& H, const Matrix&) {
        return 0.5F * lanes::trace(twice_strain(H));
    }
    static Matrix volume_gradient(const Matrix& H, const Matrix&) {
        return lanes::plus_identity(H);
    }
    static Matrix volume_curvature(const Matrix&, const Matrix&, const Matrix& dF) { return dF; }

  private:
    static Matrix twice_strain(const Matrix& H) {
        const Matrix T = lanes::transposed(H);
        return H + T + T * H;
    }
    static Matrix second_stress(const Number& lambda, const Number& mu, const Matrix& C) {
        return lanes::plus_diagonal(mu * C, 0.5F * lambda * lanes::trace(C));
    }
};

}  // namespace

const BatchLaw* Green::batch_law() const {
    static const LaneLaw<GreenInLanes> law;
    return &law;
}

ConstitutiveModel::Names Green::names() const {
    return {"green", "Green",
            "Green's strain (St Venant-Kirchhoff): large rotation, tension; softens and collapses "
            "in compression"};
}

double Green::volume_strain(const Matrix3& H, const Matrix3&) const {
    return twice_green_strain(H).trace() / 2;
}

Eigen::Matrix3d Green::volume_strain_gradient(const Matrix3& H, const Matrix3&) const {
    return deformation_gradient(H);
}

double Green::shear_energy(double mu, const Matrix3& H, const Matrix3&) const {
    return mu / 4 * twice_green_strain(H).squaredNorm();
}

Eigen::Matrix3d Green::shear_stress(double mu, const Matrix3& H, const Matrix3&) const {
    return mu * deformation_gradient(H) * twice_green_strain(H);
}

Eigen::Matrix3d Green::shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3&,
                                              const Matrix3& dF) const {
    const Matrix3 F = deformation_gradient(H), FdF = F.transpose() * dF;
    return mu * (dF * twice_green_strain(H) + F * (FdF + FdF.transpose())) + p * dF;
}

Matrix9 Green::shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const {
    const SignedSvd svd = signed_svd(deformation_gradient(H));
    PrincipalModes m;
    m.stretch = (3 * mu * svd.sigma.cwiseAbs2().array() - mu + p).matrix().asDiagonal();
    for (int k = 0; k < 3; ++k) {
        const double a = svd.sigma[(k + 1) % 3], b = svd.sigma[(k + 2) % 3];
        m.flip[k] = p - mu + mu * (a * a + b * b + a * b);
        m.twist[k] = p - mu + mu * (a * a + b * b - a * b);
    }
    return isotropic_tangent(svd, m, tangent);
}

}  // namespace livetet
