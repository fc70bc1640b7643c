#include "tracking/pose_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

TrackedPose at(const Vector3d& position, double turn = 0) {
    return {AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix(), position, PoseStatus::ok};
}

double turn_between(const TrackedPose& a, const TrackedPose& b) {
    return AngleAxisd(Eigen::Matrix3d(a.rotation.transpose() * b.rotation)).angle();
}

TEST(PoseFilter, CalmsTheNoiseOfASensorAtRest) {
    TrackerNoise noise(1.4e-3, 0.009, 3);
    PoseFilterOptions options;
    options.beta_per_m = options.beta_per_rad = 0;
    PoseFilter filter(options);
    double before = 0, after = 0, turn_before = 0, turn_after = 0;
    for (int i = 0; i < 2000; ++i) {
        const TrackedPose raw = noise(at({0.1, 0, 0})), smooth = filter.update(i / 40.0, raw);
        if (i < 100) continue;
        before += (raw.translation - Vector3d(0.1, 0, 0)).squaredNorm();
        after += (smooth.translation - Vector3d(0.1, 0, 0)).squaredNorm();
        turn_before += std::pow(turn_between(raw, at({0, 0, 0})), 2);
        turn_after += std::pow(turn_between(smooth, at({0, 0, 0})), 2);
    }
    // An exponential average reduces the variance to alpha / (2 - alpha), alpha = 1 / (1 + 40 / (2
    // pi)).
    const double alpha = 1 / (1 + 40 / (2 * M_PI)), left = alpha / (2 - alpha);
    EXPECT_NEAR(after / before, left, 0.15 * left);
    EXPECT_NEAR(turn_after / turn_before, left, 0.15 * left);
}

TEST(PoseFilter, LagsLessWithBetaWhenTheSensorMoves) {
    double lag[2];
    for (const int with_beta : {0, 1}) {
        PoseFilterOptions options;
        options.beta_per_m = with_beta * 50;
        options.beta_per_rad = with_beta * 2;
        PoseFilter filter(options);
        TrackedPose smooth;
        for (int i = 0; i <= 200; ++i)
            smooth = filter.update(i / 40.0, at({0.1 * i / 40.0, 0, 0}, 0.5 * i / 40.0));
        lag[with_beta] = 0.5 - smooth.translation.x();
        EXPECT_GT(turn_between(smooth, at({0, 0, 0}, 2.5)), 0);
    }
    EXPECT_NEAR(lag[0], 0.1 / (2 * M_PI), 1e-4);  // speed times the filter's time constant
    EXPECT_NEAR(lag[1], 0.1 / (2 * M_PI * (1 + 50 * 0.1)), 1e-4);
}

TEST(PoseFilter, DoesNotDependOnTheAxes) {
    const Eigen::Matrix3d turn = AngleAxisd(1, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    PoseFilter filter, turned;
    for (int i = 0; i < 100; ++i) {
        const TrackedPose raw = at({std::sin(i / 5.0), std::cos(i / 7.0), 0.01 * i}, 0.02 * i);
        const TrackedPose a = filter.update(i / 30.0, raw);
        const TrackedPose b =
            turned.update(i / 30.0, {turn * raw.rotation, turn * raw.translation, PoseStatus::ok});
        EXPECT_LT((turn * a.translation - b.translation).norm(), 1e-12);
        EXPECT_LT((turn * a.rotation - b.rotation).norm(), 1e-12);
    }
}

TEST(PoseFilter, SurvivesAnyTimesAndPoses) {
    PoseFilter filter;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    int i = 0;  // number of poses
    for (const double t :
         {0.0, 0.0, 0.1, 0.1, 0.05, 0.1000001, 0.3, nan, 0.31, 100.0, 1.0, 1.02, 1.02}) {
        const TrackedPose pose = filter.update(t, at({0.01 * i, 0, 0}, 0.1 * i));
        EXPECT_TRUE(pose.translation.allFinite() && pose.rotation.allFinite()) << t;
        ++i;
        EXPECT_LE(pose.translation.x(), 0.01 * i + 1e-12);
        EXPECT_LT((pose.rotation * pose.rotation.transpose() - Eigen::Matrix3d::Identity()).norm(),
                  1e-12);
    }
    const TrackedPose kept = filter.update(1.03, at({0.1, 0, 0}));
    EXPECT_EQ(filter.update(1.04, TrackedPose{}).status, PoseStatus::missing);
    EXPECT_FALSE(is_usable(filter.update(1.04, at({nan, 0, 0}))));
    EXPECT_LT((filter.update(1.04, at({0.1, 0, 0})).translation - kept.translation).norm(), 0.05);
}

TEST(PoseFilter, StartsAfreshAfterAGapAndDoesNothingWhenOff) {
    PoseFilter filter;
    filter.update(0, at({0, 0, 0}));
    EXPECT_LT(filter.update(0.02, at({1, 0, 0})).translation.x(), 1);
    EXPECT_EQ(filter.update(0.6, at({1, 0, 0}, 1)).translation.x(), 1);
    PoseFilterOptions off;
    off.enabled = false;
    PoseFilter open(off);
    open.update(0, at({0, 0, 0}));
    EXPECT_EQ(open.update(0.01, at({1, 0, 0})).translation.x(), 1);
    off.min_cutoff_Hz = 0;
    EXPECT_THROW(PoseFilter{off}, Error);
}

TEST(PoseFilter, CarriesAPoseOnByItsSpeedsToMakeUpForLatency) {
    PoseFilterOptions options;
    options.ahead_s = 0.05;
    PoseFilter filter(options), plain;
    TrackedPose ahead, now;
    for (int i = 0; i <= 200;
         // Constant 0.1 m/s and 0.5 rad/s for four seconds, until the speeds have converged.
         ++i) {
        const double t = 0.02 * i;
        ahead = filter.update(t, at({0.1 * t, 0, 0}, 0.5 * t));
        now = plain.update(t, at({0.1 * t, 0, 0}, 0.5 * t));
    }
    EXPECT_NEAR(ahead.translation.x() - now.translation.x(), 0.1 * 0.05, 1e-6);
    EXPECT_NEAR(Eigen::AngleAxisd(ahead.rotation * now.rotation.transpose()).angle(), 0.5 * 0.05,
                1e-6);
    EXPECT_EQ(filter.update(4, at({0.4, 0, 0}, 2)).translation, ahead.translation)
        << "a time that stands still";
    options.ahead_s = -1;
    EXPECT_THROW(PoseFilter{options}, Error);
}

}  // namespace
}  // namespace livetet
