#include "geometry/transform.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace livetet {
namespace {

TEST(RigidDisplacement, TurnsAboutThePivotAndThenMoves) {
    const Eigen::Matrix3d quarter =
        Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Vector3d pivot(1, 2, 3), translation(0, 0, 0.5);
    EXPECT_LT((rigid_displacement(quarter, translation, pivot, pivot) - translation).norm(), 1e-15);
    // (2, 2, 3) goes to (1, 3, 3.5).
    EXPECT_LT(
        (rigid_displacement(quarter, translation, pivot, {2, 2, 3}) - Eigen::Vector3d(-1, 1, 0.5))
            .norm(),
        1e-15);
}

}  // namespace
}  // namespace livetet
