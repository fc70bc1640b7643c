#include "mechanics/materials/isotropic_tangent.hpp"

#include <Eigen/Dense>

namespace livetet {

namespace {

using Vector9 = Eigen::Matrix<double, 9, 1>;

Vector9 stacked(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    const Eigen::Matrix3d m = u * v.transpose();
    return Eigen::Map<const Vector9>(m.data());
}

}  // namespace

Matrix9 isotropic_tangent(const SignedSvd& svd, PrincipalModes m, Tangent tangent) {
    if (tangent != Tangent::exact) {
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
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

}  // namespace livetet
