#include "mechanics/tet_kernels.hpp"

#include <gtest/gtest.h>

#include <random>

#include "mechanics/materials/corotated.hpp"
#include "mechanics/materials/neohookean.hpp"

namespace livetet {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;

const std::array<Vector3d, 4> corners{Vector3d(0.1, 0, 0), Vector3d(1.1, 0.2, 0),
                                      Vector3d(0, 0.9, 0.1), Vector3d(0.2, 0.1, 1.2)};
const TetElement element = make_element(corners, 2.0, 1.5);

template <int nodes>
Eigen::Matrix<double, 3, nodes> positions() {
    Eigen::Matrix<double, 3, nodes> x;
    for (int i = 0; i < 4; ++i) x.col(i) = corners[i];
    for (int k = 4; k < nodes; ++k)
        x.col(k) = (corners[tet_edges[k - 4][0]] + corners[tet_edges[k - 4][1]]) / 2;
    return x;
}

template <int nodes>
void expect_gradient_of_linear_field() {
    Matrix3d A;
    A << 1, 2, 3, 4, 5, 6, 7, 8, 10;
    for (int q = 0; q < TetShape<nodes>::points; ++q) {
        const auto g = TetShape<nodes>::gradients(element, q);
        EXPECT_LT((A * positions<nodes>() * g.transpose() - A).norm(), 1e-12);
    }
}

TEST(TetShape, GradientOfALinearFieldIsItsMatrix) {
    expect_gradient_of_linear_field<4>();
    expect_gradient_of_linear_field<10>();
}

TEST(TetShape, TenNodesReproduceAQuadraticField) {
    // v = x^2 + 2 yz: grad v = (2 x, 2 z, 2 y) at each point.
    const auto x = positions<10>();
    for (int q = 0; q < 4; ++q) {
        const Vector4d L = TetShape<10>::coordinates(q);
        Vector3d at = Vector3d::Zero(), gradient = Vector3d::Zero();
        for (int i = 0; i < 4; ++i) at += L[i] * corners[i];
        for (int k = 0; k < 10; ++k)
            gradient += (x(0, k) * x(0, k) + 2 * x(1, k) * x(2, k)) *
                        TetShape<10>::gradients(element, q).col(k);
        EXPECT_LT((gradient - Vector3d(2 * at.x(), 2 * at.z(), 2 * at.y())).norm(), 1e-12);
    }
}

TEST(TetShape, SharesOfMassAndForceSumToOne) {
    double mass = 0, force = 0;
    for (int k = 0; k < 10; ++k) {
        mass += TetShape<10>::mass_share(k);
        force += TetShape<10>::force_share(k);
    }
    EXPECT_NEAR(mass, 1, 1e-14);
    EXPECT_NEAR(force, 1, 1e-14);
}

/// K_ij e_c = V dP g_i, with the increment of stress of dH = e_c g_j^T.
template <class Gradients, class Matrix, class Increment>
void expect_increments(const Gradients& g, const Matrix& K, double weight, Increment&& dP) {
    for (int j = 0; j < Gradients::ColsAtCompileTime; ++j)
        for (int c = 0; c < 3; ++c) {
            const Matrix3d forces = weight * dP(Vector3d::Unit(c) * g.col(j).transpose());
            for (int i = 0; i < Gradients::ColsAtCompileTime; ++i)
                EXPECT_LT((forces * g.col(i) - K.template block<3, 1>(3 * i, 3 * j + c)).norm(),
                          1e-12);
        }
}

Matrix3d random_displacement_gradient() {
    std::mt19937 generator(3);
    std::normal_distribution<double> normal;
    return Matrix3d::NullaryExpr([&] { return 0.3 * normal(generator); });
}

TEST(StiffnessOfPoint, IsTheDerivativeOfTheStressWithTheRotationHeld) {
    const Corotated corotated;
    const Matrix3d H = random_displacement_gradient(), R = rotation_of(Matrix3d::Identity() + H);
    ElementMatrix<4> K = ElementMatrix<4>::Zero();
    add_stiffness_of_point(corotated, Tangent::frozen_rotation, element.volume, element.mu,
                           element.lambda, 0, H, R, element.gradients, K);
    expect_increments(element.gradients, K, element.volume, [&](const Matrix3d& dF) -> Matrix3d {
        return corotated.shear_stress_increment(element.mu, 0, H, R, dF) +
               element.lambda * R.cwiseProduct(dF).sum() * R;
    });
}

TEST(StiffnessOfPoint, IsAddedToWhatOtherPointsGave) {
    const NeoHookean model;
    const Matrix3d H = random_displacement_gradient(), R = Matrix3d::Identity();
    const double p = element.lambda * model.volume_strain(H, R);
    const Matrix3d theta = model.volume_strain_gradient(H, R);
    const auto g = TetShape<10>::gradients(element, 2);
    const Matrix9 A = model.shear_tangent(element.mu, p, H, Tangent::exact);
    ElementMatrix<10> K = ElementMatrix<10>::Constant(2);
    add_stiffness_of_point(model, Tangent::exact, 0.3, element.mu, element.lambda, p, H, R, g, K);
    K.array() -= 2;
    expect_increments(g, K, 0.3, [&](const Matrix3d& dF) -> Matrix3d {
        const Eigen::Matrix<double, 9, 1> dP = A * dF.reshaped();
        return Matrix3d(dP.reshaped(3, 3)) + element.lambda * theta.cwiseProduct(dF).sum() * theta;
    });
}

}  // namespace
}  // namespace livetet
