// What live frames take of the neo-Hookean model.

#include "mechanics/materials/neohookean.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace livetet {
namespace {

using Eigen::Matrix3d;

Matrix9 bounded_tangent(double lambda, double mu, const Matrix3d& H) {
    Matrix9 tangent;
    for (int j = 0; j < 9; ++j) {
        Matrix3d dF = Matrix3d::Zero();
        dF.data()[j] = 1;
        const Matrix3d dP = NeoHookean().bounded_increment(lambda, mu, H, Matrix3d::Identity(), dF);
        tangent.col(j) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(dP.data());
    }
    return tangent;
}

Matrix9 exact_tangent(double lambda, double mu, const Matrix3d& H) {
    const NeoHookean model;
    const Matrix3d N = model.volume_strain_gradient(H, Matrix3d::Identity());
    const Eigen::Map<const Eigen::Matrix<double, 9, 1>> n(N.data());
    return model.shear_tangent(mu, lambda * model.volume_strain(H, {}), H, Tangent::exact) +
           lambda * n * n.transpose();
}

double lowest(const Matrix9& tangent) {
    return Eigen::SelfAdjointEigenSolver<Matrix9>(tangent, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

/// Over strains of every kind, inverted ones too: above -0.1 mu, where the exact tangent reaches
/// -1000 mu.
TEST(NeoHookean, BoundedIncrementIsAllButPositive) {
    std::mt19937 generator(1);
    std::normal_distribution<double> normal;
    double of_bounded = 0, of_exact = 0;
    for (const double lambda : {0.0, 1.0, 9.0, 50.0})
        for (const double size : {0.1, 0.3, 0.6, 2.0})
            for (int trial = 0; trial < 400; ++trial) {
                Matrix3d H;
                for (double& h : H.reshaped()) h = size * normal(generator);
                const Matrix9 tangent = bounded_tangent(lambda, 1, H);
                ASSERT_LT((tangent - tangent.transpose()).norm(), 1e-9 * tangent.norm());
                of_bounded = std::min(of_bounded, lowest(tangent));
                of_exact = std::min(of_exact, lowest(exact_tangent(lambda, 1, H)));
            }
    EXPECT_GT(of_bounded, -0.1);
    EXPECT_LT(of_exact, -1000);
}

/// Where the tissue is at rest or drawn a little, nothing is bounded.
TEST(NeoHookean, BoundedIncrementIsExactWhereNothingIsPressed) {
    for (const double stretch : {0.0, 0.01, 0.03}) {
        Matrix3d H = stretch * Matrix3d::Identity();
        H(0, 1) = stretch / 10;
        EXPECT_LT((bounded_tangent(9, 1, H) - exact_tangent(9, 1, H)).norm(), 1e-12) << stretch;
    }
}

}  // namespace
}  // namespace livetet
