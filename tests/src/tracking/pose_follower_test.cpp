#include "tracking/pose_follower.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "tracking/poses.hpp"

namespace livetet {
namespace {

using Eigen::Vector3d;

TrackedPose at(double x, PoseStatus status = PoseStatus::ok) {
    return {Eigen::Matrix3d::Identity(), {x, 0, 0}, status};
}

/// Feeds a second of motion at 0.1 m/s, 50 samples, ending at time 1 and x = 0.1.
PoseFollower moved(const PoseFollowerOptions& options) {
    PoseFollower follower(options);
    for (int k = 0; k <= 50; ++k) follower.update(0.02 * k, at(0.002 * k));
    return follower;
}

TEST(PoseFollower, EstimatesAheadOfTheSample) {
    EXPECT_NEAR(moved({}).update(1.02, at(0.102)).pose.translation.x(), 0.102, 1e-5);
    EXPECT_NEAR(moved({.ahead_s = 0.05}).update(1.02, at(0.102)).pose.translation.x(), 0.107, 2e-5);
}

TEST(PoseFollower, ATimeGivenWithAPoseTakesThePlaceOfTheOption) {
    PoseFollower given = moved({}), fixed = moved({.ahead_s = 0.05}), plain = moved({});
    const Vector3d ahead = given.update(1.02, at(0.102), 0.05).pose.translation;
    EXPECT_EQ(ahead, fixed.update(1.02, at(0.102)).pose.translation);
    EXPECT_EQ(given.update(1.02, at(0.102), 0.05).pose.translation, ahead) << "sent again";
    EXPECT_NEAR(fixed.update(1.04, at(0.104), 0).pose.translation.x(), 0.104, 1e-5);
    EXPECT_NEAR(given.update(1.04, at(0.104)).pose.translation.x(), 0.104, 1e-5)
        << "it holds for one call";

    PoseFollower as_measured = moved({.filter = PoseFilterOptions{.enabled = false}});
    EXPECT_EQ(as_measured.update(1.02, at(0.102), 0.05).pose.translation.x(), 0.102);
    for (const double ahead_s : {-0.1, 0.6, std::numeric_limits<double>::quiet_NaN()})
        EXPECT_THROW(plain.update(1.02, at(0.102), ahead_s), Error);
}

/// What the error statement takes: the covariance grows with the time of the prediction.
TEST(PoseFollower, TheEstimateInUseIsThatOfTheTimeAhead) {
    PoseFollower plain = moved({}), ahead = moved({});
    plain.update(1.02, at(0.102));
    ahead.update(1.02, at(0.102), 0.05);
    ASSERT_TRUE(plain.used() && ahead.used());
    EXPECT_EQ(ahead.used()->time_s, 1.02 + 0.05);
    EXPECT_EQ(ahead.used()->covariance, plain.estimator().predict(1.02 + 0.05)->covariance);
    EXPECT_GT(ahead.used()->covariance.trace(), 1.05 * plain.used()->covariance.trace());
}

TEST(PoseFollower, SmoothsOrPassesOnWhereAFilterIsGiven) {
    PoseFollower smooth = moved({.filter = PoseFilterOptions{.beta_per_m = 0}});
    EXPECT_LT(smooth.update(1.02, at(0.102)).pose.translation.x(), 0.09) << "it lags";
    PoseFollower as_measured = moved({.filter = PoseFilterOptions{.enabled = false}});
    EXPECT_EQ(as_measured.update(1.02, at(0.1037)).pose.translation.x(), 0.1037);
}

TEST(PoseFollower, UsesThePredictionOrTheLastPoseInPlaceOfAnOutlier) {
    PoseFollower estimated = moved({});
    const auto held = estimated.update(1.02, at(0.4));
    EXPECT_EQ(held.verdict, PoseVerdict::held);
    EXPECT_FALSE(is_usable(held.unfiltered));
    const auto again = estimated.update(1.02, at(0.4));
    EXPECT_EQ(again.verdict, PoseVerdict::held) << "sent again, it is an outlier still";
    EXPECT_FALSE(is_usable(again.unfiltered));
    EXPECT_NEAR(held.pose.translation.x(), 0.102, 1e-5);
    PoseFollower as_measured = moved({.filter = PoseFilterOptions{.enabled = false}});
    EXPECT_EQ(as_measured.update(1.02, at(0.4)).pose.translation.x(), 0.1);
    EXPECT_EQ(as_measured.update(1.02, at(0.41)).pose.translation.x(), 0.1);
    for (double t = 1.04; t < 1.1; t += 0.02) as_measured.update(t, at(0.4));
    EXPECT_EQ(as_measured.update(1.1, at(0.4)).pose.translation.x(), 0.4) << "it stays there";
}

TEST(PoseFollower, PassesOnUnusablePosesAndAnyTimes) {
    PoseFollower follower = moved({});
    for (const PoseStatus status : {PoseStatus::missing, PoseStatus::stale}) {
        const auto result = follower.update(1.02, at(0, status));
        EXPECT_EQ(result.verdict, PoseVerdict::unusable);
        EXPECT_EQ(result.pose.status, status);
    }
    const auto again = follower.update(1, at(7));
    EXPECT_EQ(again.verdict, PoseVerdict::accepted) << "as that of the sample before";
    EXPECT_NEAR(again.pose.translation.x(), 0.1, 1e-5) << "no new sample";
    EXPECT_EQ(follower.update(std::nan(""), at(0)).verdict, PoseVerdict::unusable);
}

TEST(PoseFollower, ExtrapolatesNoFurtherThanAGapMayBe) {
    PoseFollower follower = moved({.ahead_s = 0.45});
    EXPECT_NEAR(follower.update(1.02, at(0.102)).pose.translation.x(), 0.147, 2e-4);
    EXPECT_NEAR(follower.update(1.12, at(0.9)).pose.translation.x(), 0.152, 2e-4)
        << "held; no further than 0.5 s after the last accepted pose";
}

TEST(PoseFollower, RefusesBadOptions) {
    for (const double ahead_s : {-0.1, 0.6, std::numeric_limits<double>::quiet_NaN()})
        EXPECT_THROW(PoseFollower({.ahead_s = ahead_s}), Error);
    EXPECT_THROW(PoseFollower({.estimator = {.position_rms = 0}}), Error);
    EXPECT_THROW(PoseFollower({.filter = PoseFilterOptions{.min_cutoff_Hz = 0}}), Error);
}

}  // namespace
}  // namespace livetet
