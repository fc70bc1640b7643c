#include "tracking/pose_smoother.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>

#include "base/error.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

TrackedPose placed_at(double x) { return {Matrix3d::Identity(), {x, 0, 0}, PoseStatus::ok}; }

// With one model the problem is linear: the estimate is the conditional mean of all states given
// all measurements, which a dense solve of the information matrix gives.
TEST(PoseSmoother, IsTheLeastSquaresEstimateOfAllSamples) {
    PoseEstimatorOptions options;
    options.acceleration_densities.fill(0.02);
    const double r = options.position_rms * options.position_rms / 3;
    constexpr int n = 12, k = 7;
    const auto time = [](int i) { return 0.03 * i + 0.01 * std::sin(7.0 * i); };
    const auto measured = [](int i) { return 0.001 * std::cos(1.7 * i); };
    PoseSmoother smoother(options, time(n - 1) - time(k) - 1e-9);
    MatrixXd information = MatrixXd::Zero(2 * n, 2 * n);
    VectorXd right = VectorXd::Zero(2 * n);
    // The first measurement is the start; its variance and the speed's are the prior.
    information(1, 1) = 1 / (options.start_speed * options.start_speed);
    for (int i = 0; i < n; ++i) {
        smoother.update(time(i), placed_at(measured(i)));
        information(2 * i, 2 * i) += 1 / r;
        right(2 * i) += measured(i) / r;
        if (i == 0) continue;
        const double dt = time(i) - time(i - 1);
        Eigen::Matrix<double, 2, 4> residual;  // x_i - F x_(i-1)
        residual << -motion_transition(dt), Eigen::Matrix2d::Identity();
        information.block<4, 4>(2 * i - 2, 2 * i - 2) +=
            residual.transpose() * (0.02 * motion_noise(dt)).inverse() * residual;
    }
    const MatrixXd covariance = information.inverse();
    const VectorXd mean = covariance * right;
    const PoseEstimate estimate = smoother.smoothed().value();
    ASSERT_EQ(smoother.estimator().position_noise_ratio(), 1);
    EXPECT_DOUBLE_EQ(estimate.time_s, time(k));
    EXPECT_NEAR(estimate.translation.x(), mean(2 * k), 1e-12);
    EXPECT_NEAR(estimate.velocity.x(), mean(2 * k + 1), 1e-10);
    EXPECT_NEAR(estimate.covariance(0, 0) / covariance(2 * k, 2 * k), 1, 1e-9);
}

TEST(PoseSmoother, IsNearerThanTheEstimatorAndStatesItsCovariance) {
    for (const double rate : {15.0, 40.0, 80.0}) {
        PoseSmoother smoother;
        TrackerNoise noise(1.4e-3, 0.5 * radians_per_degree, 2);
        double late = 0, direct = 0, late_turn = 0, direct_turn = 0, normalised = 0;
        int n = 0;
        const auto truth = [](double t) { return pose_of(true_tracker_from_image({}, t)); };
        const auto turn = [&](const PoseEstimate& e) {
            return rotation_vector(truth(e.time_s).rotation * e.rotation.transpose());
        };
        for (int i = 0; i < 60 * rate; ++i) {
            const double t = i / rate;
            smoother.update(t, noise(truth(t)));
            if (t < 3) continue;
            const PoseEstimate now = smoother.estimator().predict(t).value();
            const PoseEstimate past = smoother.smoothed().value();
            EXPECT_NEAR(t - past.time_s, 0.071, 0.0065);
            const Vector3d error = past.translation - truth(past.time_s).translation;
            late += error.squaredNorm();
            late_turn += turn(past).squaredNorm();
            normalised += error.dot(past.covariance.topLeftCorner<3, 3>().inverse() * error);
            direct += (now.translation - truth(t).translation).squaredNorm();
            direct_turn += turn(now).squaredNorm();
            ++n;
        }
        EXPECT_LT(late, 0.6 * direct) << rate;
        EXPECT_LT(late_turn, 0.6 * direct_turn) << rate;
        EXPECT_NEAR(normalised / (3 * n), 0.85, 0.25) << rate;
    }
}

TEST(PoseSmoother, DoesNotSmoothAcrossARestart) {
    PoseSmoother smoother;
    EXPECT_FALSE(smoother.smoothed());
    for (int i = 0; i < 40; ++i) smoother.update(i / 40.0, placed_at(0));
    EXPECT_EQ(smoother.update(2, placed_at(1)), PoseVerdict::started);
    EXPECT_NEAR(smoother.smoothed()->translation.x(), 1, 1e-12);
    EXPECT_EQ(smoother.smoothed()->time_s, 2);
    smoother.update(2.025, placed_at(1));
    EXPECT_EQ(smoother.smoothed()->time_s, 2);
    EXPECT_NEAR(smoother.smoothed()->translation.x(), 1, 1e-12);
}

TEST(PoseSmoother, KeepsTheLastStepsOfAFastTracker) {
    PoseSmoother smoother({}, 0.5);
    for (int i = 0; i <= 1000; ++i) smoother.update(i / 1024.0, placed_at(0.1 * i / 1024.0));
    EXPECT_EQ(smoother.smoothed()->time_s, (1000 - 127) / 1024.0);
    EXPECT_NEAR(smoother.smoothed()->translation.x(), 0.1 * (1000 - 127) / 1024.0, 1e-4);
    EXPECT_THROW(PoseSmoother({}, -0.1), Error);
    EXPECT_THROW(PoseSmoother({}, std::nan("")), Error);
}

}  // namespace
}  // namespace livetet
