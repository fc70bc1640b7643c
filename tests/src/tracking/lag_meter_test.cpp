#include "tracking/lag_meter.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tracking/pose_follower.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using Eigen::Vector3d;

/// Breathing by 15 mm, 4 s a breath.
TrackedPose breathing(double time_s) {
    return {Eigen::Matrix3d::Identity(),
            {0, 0.0075 * std::sin(2 * M_PI * time_s / 4), 0.1},
            PoseStatus::ok};
}

std::optional<double> lag_of(const PoseFollowerOptions& options, double seconds) {
    PoseFollower follower(options);
    TrackerNoise noise(options.estimator.position_rms, options.estimator.rotation_rms, 5);
    for (int k = 0; k < 40 * seconds; ++k) follower.update(0.025 * k, noise(breathing(0.025 * k)));
    return follower.quality().lag_s;
}

TEST(LagMeter, FindsAKnownLag) {
    for (const double lag : {0.05, 0.0, -0.03}) {
        LagMeter meter;
        PoseEstimate truth;
        for (int k = 0; k < 1200; ++k) {
            const double t = 0.025 * k;
            meter.use(t, breathing(t - lag).translation);
            truth.time_s = t;
            truth.translation = breathing(t).translation;
            truth.velocity =
                (breathing(t + 1e-4).translation - breathing(t - 1e-4).translation) / 2e-4;
            meter.compare(truth);
            meter.compare(truth);
            meter.use(t, Vector3d::Zero());  // the same sample again
        }
        ASSERT_TRUE(meter.lag_s()) << lag;
        EXPECT_NEAR(*meter.lag_s(), lag, 1e-3);
    }
}

TEST(LagMeter, SeesTheLagOfAFilterThroughNoise) {
    PoseFilterOptions slow;
    slow.min_cutoff_Hz = 2;
    slow.beta_per_m = 0;  // a low-pass filter lags by 1 / (2 pi f)
    const auto filtered = lag_of({.filter = slow}, 40);
    ASSERT_TRUE(filtered);
    EXPECT_NEAR(*filtered, 1 / (4 * M_PI), 0.01);
    const auto raw = lag_of({.filter = PoseFilterOptions{.enabled = false}}, 40);
    ASSERT_TRUE(raw);
    EXPECT_NEAR(*raw, 0, 0.01);
    const auto estimated = lag_of({}, 40), ahead = lag_of({.ahead_s = 0.1}, 40);
    ASSERT_TRUE(estimated && ahead);
    EXPECT_NEAR(*estimated, 0.005, 0.015);
    EXPECT_NEAR(*estimated - *ahead, 0.1, 0.015);
}

TEST(LagMeter, SaysNothingOfAToolAtRest) {
    PoseFollower follower;
    TrackerNoise noise(1.4e-3, 0.009, 5);
    for (int k = 0; k < 4000; ++k) follower.update(0.025 * k, noise(breathing(0)));
    EXPECT_FALSE(follower.quality().lag_s);
    EXPECT_FALSE(lag_of({}, 1)) << "too early to tell";
}

TEST(LagMeter, GoesOnAfterTheClockIsSetBack) {
    LagMeter meter;
    PoseEstimate at;
    at.velocity = {0.1, 0, 0};
    for (const double start : {1e6, 0.0})
        for (int k = 0; k < 100; ++k) {
            at.time_s = start + 0.02 * k;
            at.translation.x() = 0.002 * k;
            meter.use(at.time_s, at.translation - Vector3d(start > 0 ? 0 : 0.005, 0, 0));
            meter.compare(at);
        }
    EXPECT_NEAR(*meter.lag_s(), 0.05 / (1 + std::exp(-2 / LagMeter::memory_s)), 2e-3);
}

}  // namespace
}  // namespace livetet
