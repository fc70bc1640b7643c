#include "mechanics/rotation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace livetet {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d random_matrix(std::mt19937& generator) {
    std::normal_distribution<double> normal;
    return Matrix3d::NullaryExpr([&] { return normal(generator); });
}

bool is_rotation(const Matrix3d& R) {
    return (R * R.transpose() - Matrix3d::Identity()).norm() < 1e-12 &&
           std::abs(R.determinant() - 1) < 1e-12;
}

TEST(Rotation, IsTheFactorOfAStretchedRotation) {
    std::mt19937 generator(1);
    for (int i = 0; i < 200; ++i) {
        const Matrix3d R = AngleAxisd(3.1 * i / 200, random_matrix(generator).col(0).normalized())
                               .toRotationMatrix();
        const Matrix3d A = random_matrix(generator);
        const Matrix3d stretch = Matrix3d::Identity() + 0.2 * A * A.transpose();
        EXPECT_LT((rotation_of(R * stretch) - R).norm(), 1e-10);
    }
}

TEST(Rotation, IsNeverAReflectionAndNothingElseFitsBetter) {
    std::mt19937 generator(2);
    for (int i = 0; i < 2000; ++i) {
        const Matrix3d F = random_matrix(generator);
        const Matrix3d R = rotation_of(F);
        ASSERT_TRUE(is_rotation(R)) << F;
        const double fit = (R.transpose() * F).trace();
        for (int k = 0; k < 20; ++k) {
            const Matrix3d other =
                R *
                AngleAxisd(0.05, random_matrix(generator).col(0).normalized()).toRotationMatrix();
            ASSERT_LE((other.transpose() * F).trace(), fit + 1e-12);
        }
    }
}

TEST(Rotation, OfFlatLineAndPointElementsIsARotation) {
    for (const Vector3d& sigma :
         {Vector3d(1, 1, 0), Vector3d(1, 0, 0), Vector3d(0, 0, 0), Vector3d(1, 1, -1),
          Vector3d(1, 1e-14, 1e-14), Vector3d(1e-20, 1e-20, 1e-20), Vector3d(1e150, 1, 1)})
        EXPECT_TRUE(is_rotation(rotation_of(sigma.asDiagonal()))) << sigma.transpose();
}

TEST(Rotation, DoesNotJumpWhenAnElementIsPressedThroughFlat) {
    const Matrix3d turn = AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    for (double s = 0.6; s > -0.6; s -= 0.01) {
        const Matrix3d here = rotation_of(turn * Vector3d(1, 0.9, s).asDiagonal());
        EXPECT_LT((here - turn).norm(), 1e-10) << s;
    }
}

}  // namespace
}  // namespace livetet
