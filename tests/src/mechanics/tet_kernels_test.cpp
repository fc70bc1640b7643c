#include "mechanics/tet_kernels.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "mechanics/rotation.hpp"

namespace livetet {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Nodal = Eigen::Matrix<double, 3, 4>;

const std::array<Vector3d, 4> corners{Vector3d(0.1, 0, 0), Vector3d(1.1, 0.2, 0), Vector3d(0, 0.9, 0.1),
                                      Vector3d(0.2, 0.1, 1.2)};
const TetElement element = make_element(corners, 2.0, 1.5);

Nodal positions() {
    Nodal x;
    for (int i = 0; i < 4; ++i) x.col(i) = corners[i];
    return x;
}

Nodal some_displacement(double size) {
    std::mt19937 generator(3);
    std::normal_distribution<double> normal;
    return Nodal::NullaryExpr([&] { return size * normal(generator); });
}

Nodal corotated_forces(const Nodal& u) {
    const Matrix3d F = Matrix3d::Identity() + gradient_of(element, u);
    return nodal_forces(element, first_piola(element, rotation_of(F), F));
}

double corotated_energy(const Nodal& u) {
    const Matrix3d F = Matrix3d::Identity() + gradient_of(element, u);
    return element.volume * corotated_energy_density(element, rotation_of(F), F);
}

TEST(TetKernels, GradientOfALinearFieldIsItsMatrix) {
    Matrix3d A;
    A << 1, 2, 3, 4, 5, 6, 7, 8, 10;
    EXPECT_LT((gradient_of(element, A * positions()) - A).norm(), 1e-12);
}

TEST(TetKernels, ARigidMotionMakesNoCorotatedForce) {
    const Matrix3d R = Eigen::AngleAxisd(2.5, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
    const Nodal u = (R * positions() - positions()).colwise() + Vector3d(3, 2, 1);
    EXPECT_LT(corotated_forces(u).norm(), 1e-12);
}

TEST(TetKernels, ForceIsTheDerivativeOfTheEnergy) {
    for (const double size : {0.05, 0.4, 1.5}) {  // the last inverts the element
        const Nodal u = some_displacement(size), f = corotated_forces(u);
        for (int i = 0; i < 4; ++i)
            for (int c = 0; c < 3; ++c) {
                const double h = 1e-6;
                Nodal forward = u, back = u;
                forward(c, i) += h;
                back(c, i) -= h;
                EXPECT_NEAR(f(c, i), (corotated_energy(forward) - corotated_energy(back)) / (2 * h), 1e-7) << size;
            }
    }
}

TEST(TetKernels, BlocksAreTheDerivativeOfTheForceWithTheRotationHeld) {
    const Nodal u = some_displacement(0.3);
    const Matrix3d R = rotation_of(Matrix3d::Identity() + gradient_of(element, u));
    const Nodal h = R * element.gradients;
    for (int j = 0; j < 4; ++j)
        for (int c = 0; c < 3; ++c) {
            Nodal du = Nodal::Zero();
            du(c, j) = 1;
            const Nodal df = nodal_forces(element, stress_increment(element, R, gradient_of(element, du)));
            for (int i = 0; i < 4; ++i)
                EXPECT_LT((df.col(i) - stiffness_block(element, h.col(i), h.col(j)).col(c)).norm(), 1e-12);
        }
}

/// Closed forms of `closed_forms.txt` (uniaxial with free sides, E = 1): P11 = stretch - 1 and lateral 1 - nu (stretch
/// - 1).
TEST(TetKernels, UniaxialStretchHasTheClosedForm) {
    for (const double nu : {0.0, 0.3, 0.45})
        for (const double stretch : {0.5, 0.8, 1.2, 2.0}) {
            const double lambda = nu / ((1 + nu) * (1 - 2 * nu)), mu = 1 / (2 * (1 + nu));
            const TetElement e = make_element(corners, lambda, mu);
            const double side = 1 - nu * (stretch - 1);
            const Matrix3d F = Vector3d(stretch, side, side).asDiagonal();
            const Matrix3d P = first_piola(e, rotation_of(F), F);
            EXPECT_NEAR(P(0, 0), stretch - 1, 1e-12);
            EXPECT_NEAR(P(1, 1), 0, 1e-12);
        }
}

/// Simple shear, E = 1, nu = 0.3, corotated column of the same table.
TEST(TetKernels, SimpleShearHasTheClosedForm) {
    const TetElement e = make_element(corners, 0.3 / (1.3 * 0.4), 1 / 2.6);
    Matrix3d F = Matrix3d::Identity();
    F(0, 1) = 1;
    const Matrix3d P = first_piola(e, rotation_of(F), F);
    EXPECT_NEAR(P(0, 1), 0.486128, 1e-6);
    EXPECT_NEAR(P(1, 0), 0.283103, 1e-6);
    EXPECT_NEAR(P(0, 0), 0.203025, 1e-6);
    EXPECT_NEAR(P(2, 2), 0.136193, 1e-6);
}

}  // namespace
}  // namespace livetet
