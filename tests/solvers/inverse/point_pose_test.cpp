// The rigid motion of measured points, and its derivative.

#include "solvers/inverse/point_pose.hpp"

#include <gtest/gtest.h>

namespace livetet {
namespace {

TEST(PointPose, DerivativeAgreesWithFiniteDifferences) {
    for (const double turn : {0.0, 1e-5, 0.3, 2.5}) {
        const PointPose pose{Vector3(0.1, -0.2, 0.3), Vector3(0.01, 0.02, -0.03),
                             turn * Vector3(0.6, -0.48, 0.64)};
        const Vector3 c(0.17, -0.11, 0.38);
        const auto d = pose.derivative(c);
        const double h = 1e-6;
        for (int k = 0; k < 6; ++k) {
            PointPose above = pose, below = pose;
            (k < 3 ? above.translation[k] : above.turn[k - 3]) += h;
            (k < 3 ? below.translation[k] : below.turn[k - 3]) -= h;
            EXPECT_LT((d.col(k) - (above * c - below * c) / (2 * h)).norm(), 1e-9)
                << "turn " << turn << ", coordinate " << k;
        }
    }
}

TEST(PointPose, InverseUndoesIt) {
    const PointPose pose{Vector3(0.1, 0, 0), Vector3(0.01, -0.02, 0.03), Vector3(0.2, 0.4, -0.1)};
    const Vector3 c(0.2, 0.1, -0.3);
    EXPECT_LT((pose.inverse(pose * c) - c).norm(), 1e-15);
    EXPECT_GT((pose * c - c).norm(), 0.05);
}

}  // namespace
}  // namespace livetet
