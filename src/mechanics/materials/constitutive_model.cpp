#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

namespace {

using Matrix3 = Eigen::Matrix3d;
using Vector9 = Eigen::Matrix<double, 9, 1>;

/// Second derivatives of psi_mu + p theta by the singular values: `stretch(i, j)`, and for the pair
/// of axes other than k the eigenvalues `flip[k]` of the symmetric mode and `twist[k]` of the
/// antisymmetric one.
struct Modes {
    Matrix3 stretch;
    Eigen::Vector3d flip, twist;
};

template <StrainModel model>
Modes modes_of(double mu, double p, const Eigen::Vector3d& s) {
    Modes m;
    if constexpr (model == StrainModel::linear || model == StrainModel::corotated) {
        m.stretch = 2 * mu * Matrix3::Identity();
        m.flip.setConstant(2 * mu);
        for (int k = 0; k < 3; ++k) {
            const double sum = s.sum() - s[k];
            // psi_i + psi_j over sigma_i + sigma_j
            m.twist[k] = sum > least_turned_stretch ? (2 * mu * (sum - 2) + 2 * p) / sum : 0;
        }
    } else if constexpr (model == StrainModel::green) {
        m.stretch = (3 * mu * s.cwiseAbs2().array() - mu + p).matrix().asDiagonal();
        for (int k = 0; k < 3; ++k) {
            const double a = s[(k + 1) % 3], b = s[(k + 2) % 3];
            m.flip[k] = p - mu + mu * (a * a + b * b + a * b);
            m.twist[k] = p - mu + mu * (a * a + b * b - a * b);
        }
    } else {
        const double factor = mu * (s.prod() - 2) + p;  // of dJ / d sigma
        const Eigen::Vector3d c(s[1] * s[2], s[2] * s[0], s[0] * s[1]);
        m.stretch = mu * (Matrix3::Identity() + c * c.transpose());
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            m.stretch(i, j) += factor * s[k];
            m.stretch(j, i) += factor * s[k];
            m.flip[k] = mu - factor * s[k];
            m.twist[k] = mu + factor * s[k];
        }
    }
    return m;
}

Vector9 stacked(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    const Matrix3 m = u * v.transpose();
    return Eigen::Map<const Vector9>(m.data());
}

}  // namespace

template <StrainModel model>
Matrix9 StrainEnergy<model>::shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) {
    if constexpr (model == StrainModel::linear) {
        Matrix9 A = mu * Matrix9::Identity();
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) A(3 * b + a, 3 * a + b) += mu;
        return A;
    }
    const SignedSvd svd = signed_svd(deformation(H));
    Modes m = modes_of<model>(mu, p, svd.sigma);
    if (tangent != Tangent::exact) {
        Eigen::SelfAdjointEigenSolver<Matrix3> eigen;
        eigen.computeDirect(m.stretch);
        if (eigen.eigenvalues()[0] < 0)
            m.stretch = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
                        eigen.eigenvectors().transpose();
        m.flip = m.flip.cwiseMax(0);
        m.twist = m.twist.cwiseMax(0);
    }
    Eigen::Matrix<double, 9, 3> stretches;
    for (int i = 0; i < 3; ++i) stretches.col(i) = stacked(svd.U.col(i), svd.V.col(i));
    Matrix9 A = stretches * m.stretch * stretches.transpose();
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const Vector9 ij = stacked(svd.U.col(i), svd.V.col(j)),
                      ji = stacked(svd.U.col(j), svd.V.col(i));
        A += (m.flip[k] / 2) * (ij + ji) * (ij + ji).transpose() +
             (m.twist[k] / 2) * (ij - ji) * (ij - ji).transpose();
    }
    return A;
}

template struct StrainEnergy<StrainModel::linear>;
template struct StrainEnergy<StrainModel::corotated>;
template struct StrainEnergy<StrainModel::green>;
template struct StrainEnergy<StrainModel::neohookean>;

}  // namespace livetet
