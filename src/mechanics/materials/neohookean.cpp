#include "mechanics/materials/neohookean.hpp"

#include <algorithm>
#include <cmath>

#include "mechanics/lane_law.hpp"
#include "mechanics/materials/isotropic_tangent.hpp"
#include "mechanics/materials/kinematics.hpp"

namespace livetet {

namespace {

/// With k = lambda + mu and N = cof F,
///     P = mu (F - N) + k (J - 1) N,
///     dP = mu dF + k (N : dF) N + (k (J - 1) - mu) dN.
struct NeoHookeanInLanes : DilationInLanes {
    static constexpr bool rotates = false;

    static Matrix stress(const Number& lambda, const Number& mu, const Matrix& H, const Matrix& R) {
        const Number J1 = volume_strain(H, R), trace = lanes::trace(H);
        const Matrix C = lanes::cofactor(H);
        const Matrix N = lanes::plus_diagonal(C - lanes::transposed(H), 1 + trace);
        const Matrix F_N = lanes::plus_diagonal(H + lanes::transposed(H) - C, -trace);
        return mu * F_N + ((lambda + mu) * J1) * N;
    }
    static Matrix increment(const Number& lambda, const Number& mu, const Matrix& H,
                            const Matrix& R, const Matrix& dF) {
        const Matrix F = lanes::plus_identity(H), N = lanes::cofactor(F);
        const Number k = lambda + mu;
        const Matrix dP = mu * dF + (k * lanes::dot(N, dF)) * N;
        return dP + (k * volume_strain(H, R) - mu) * lanes::cofactor_increment(F, dF);
    }
    /// The same with the factor of dN bounded, see NeoHookean::bounded_increment.
    static Matrix bounded_increment(const Number& lambda, const Number& mu, const Matrix& H,
                                    const Matrix& R, const Matrix& dF) {
        const Matrix F = lanes::plus_identity(H), N = lanes::cofactor(F);
        const Number k = lambda + mu;
        const Number xy = lanes::abs(lanes::dot(F.x, F.y)), yz = lanes::abs(lanes::dot(F.y, F.z)),
                     zx = lanes::abs(lanes::dot(F.z, F.x));
        const Number stretch =
            lanes::max(lanes::max(lanes::dot(F.x, F.x) + xy + zx, lanes::dot(F.y, F.y) + xy + yz),
                       lanes::dot(F.z, F.z) + yz + zx);
        const Number most = lanes::abs(mu) / lanes::sqrt(stretch);  // a factor may be negative
        const Number factor = lanes::min(lanes::max(k * volume_strain(H, R) - mu, -most), most);
        return mu * dF + (k * lanes::dot(N, dF)) * N + factor * lanes::cofactor_increment(F, dF);
    }
};

}  // namespace

const BatchLaw* NeoHookean::batch_law() const {
    static const LaneLaw<NeoHookeanInLanes> law;
    return &law;
}

ConstitutiveModel::Names NeoHookean::names() const {
    return {"neohookean", "neo-Hookean", "rubber, tissue: large strain, through inversion too"};
}

double NeoHookean::shear_energy(double mu, const Matrix3& H, const Matrix3&) const {
    // |F|^2 - 3 - 2 (J - 1): the first orders cancel.
    const double J1 = dilation_of(H);
    const double rest =
        H.squaredNorm() - (H.trace() * H.trace() - (H * H).trace()) - 2 * H.determinant();
    return mu / 2 * (rest + J1 * J1);
}

Eigen::Matrix3d NeoHookean::shear_stress(double mu, const Matrix3& H, const Matrix3&) const {
    // F - cof F + (J - 1) cof F, with cof F = (1 + tr H) I - H^T + cof H.
    const Matrix3 first = H + H.transpose() - H.trace() * Matrix3::Identity() - cofactor_of(H);
    return mu * (first + dilation_of(H) * cofactor_of(deformation_gradient(H)));
}

Eigen::Matrix3d NeoHookean::shear_stress_increment(double mu, double p, const Matrix3& H,
                                                   const Matrix3&, const Matrix3& dF) const {
    const Matrix3 F = deformation_gradient(H), N = cofactor_of(F);
    return mu * (dF + N.cwiseProduct(dF).sum() * N) +
           (mu * (dilation_of(H) - 1) + p) * cofactor_increment(F, dF);
}

Eigen::Matrix3d NeoHookean::bounded_increment(double lambda, double mu, const Matrix3& H,
                                              const Matrix3&, const Matrix3& dF) const {
    const Matrix3 F = deformation_gradient(H), N = cofactor_of(F);
    const double k = lambda + mu;
    const double stretch = (F.transpose() * F).cwiseAbs().rowwise().sum().maxCoeff();
    const double most = mu / std::sqrt(stretch);
    const double factor = std::clamp(k * dilation_of(H) - mu, -most, most);
    return mu * dF + k * N.cwiseProduct(dF).sum() * N + factor * cofactor_increment(F, dF);
}

namespace {

/// d (cof F) / dF, on columns stacked. (cof F)_ia = 1/2 e_ijk e_abc F_jb F_kc with the Levi-Civita
/// symbol e. So the block of columns a and b of F is e_abc e_ijk F_kc at (i, j), with c the third
/// column: plus or minus the matrix of the cross product with column c.
Matrix9 cofactor_derivative(const Eigen::Matrix3d& F) {
    Matrix9 derivative = Matrix9::Zero();
    for (int c = 0; c < 3; ++c) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        Eigen::Matrix3d minus_cross;
        minus_cross << 0, F(2, c), -F(1, c), -F(2, c), 0, F(0, c), F(1, c), -F(0, c), 0;
        derivative.block<3, 3>(3 * a, 3 * b) = minus_cross;
        derivative.block<3, 3>(3 * b, 3 * a) = -minus_cross;
    }
    return derivative;
}

}  // namespace

Matrix9 NeoHookean::shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const {
    if (tangent == Tangent::exact) {  // the increment's formula: without a decomposition
        const Matrix3 F = deformation_gradient(H), N = cofactor_of(F);
        const Eigen::Map<const Eigen::Matrix<double, 9, 1>> n(N.data());
        Matrix9 A = (mu * (dilation_of(H) - 1) + p) * cofactor_derivative(F);
        A.diagonal().array() += mu;
        A += mu * n * n.transpose();
        return A;
    }
    const SignedSvd svd = signed_svd(deformation_gradient(H));
    const Eigen::Vector3d& s = svd.sigma;
    const double factor = mu * (s.prod() - 2) + p;  // of d^2 J / ds^2
    const Eigen::Vector3d c(s[1] * s[2], s[2] * s[0], s[0] * s[1]);
    PrincipalModes m;
    m.stretch = mu * (Matrix3::Identity() + c * c.transpose());
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        m.stretch(i, j) += factor * s[k];
        m.stretch(j, i) += factor * s[k];
        m.flip[k] = mu - factor * s[k];
        m.twist[k] = mu + factor * s[k];
    }
    return isotropic_tangent(svd, m, tangent);
}

}  // namespace livetet
