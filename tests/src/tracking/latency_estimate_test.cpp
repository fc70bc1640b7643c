#include "tracking/latency_estimate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <type_traits>

namespace livetet {
namespace {

static_assert(std::is_trivially_copyable_v<LatencyEstimate>, "it owns no memory");

LatencyEstimate estimate_after(int frames, double latency_s) {
    LatencyEstimate estimate;
    for (int k = 0; k < frames; ++k) estimate.add(latency_s);
    return estimate;
}

TEST(LatencyEstimate, FindsASteadyLatencyWithoutAJump) {
    EXPECT_EQ(LatencyEstimate().seconds(), 0);
    EXPECT_NEAR(estimate_after(200, 0.02).seconds(), 0.02, 1e-5);
    LatencyEstimate estimate;
    for (int k = 0; k < 200; ++k) {
        const double before_s = estimate.seconds();
        estimate.add(0.02);
        EXPECT_GE(estimate.seconds(), before_s);
        EXPECT_LT(estimate.seconds() - before_s, 0.0011) << k;
    }
}

TEST(LatencyEstimate, LateFramesDoNotMatterIfMostAreNot) {
    LatencyEstimate estimate = estimate_after(200, 0.02);
    const double before_s = estimate.seconds();
    estimate.add(5);
    EXPECT_NEAR(estimate.seconds(), before_s, 1e-6);
    for (int k = 0; k < 300; ++k) estimate.add(k % 3 == 0 ? 0.09 : 0.02);
    EXPECT_NEAR(estimate.seconds(), 0.02, 1e-5);

    LatencyEstimate late_start;
    late_start.add(0.8);
    for (int k = 0; k < 20; ++k) late_start.add(0.02);
    EXPECT_LT(late_start.seconds(), 0.02);
}

TEST(LatencyEstimate, FollowsADrift) {
    LatencyEstimate estimate = estimate_after(200, 0.02);
    double latency_s = 0.02;
    for (int k = 0; k < 400; ++k) estimate.add(latency_s += 1e-4);  // to 60 ms
    // A ramp lags by half the window and by the mean of the exponential weights: 15 + 19 frames.
    EXPECT_NEAR(estimate.seconds(), latency_s - 34e-4, 1e-5);
    for (int k = 0; k < 200; ++k) estimate.add(0.01);
    EXPECT_NEAR(estimate.seconds(), 0.01, 5e-5) << "and back";
}

TEST(LatencyEstimate, StaysWithinItsBoundAndIgnoresWhatIsNoLatency) {
    EXPECT_NEAR(estimate_after(300, 7).seconds(), LatencyEstimate::max_s, 1e-6);
    EXPECT_LE(estimate_after(300, 7).seconds(), LatencyEstimate::max_s);
    LatencyEstimate estimate = estimate_after(200, 0.02);
    const double before_s = estimate.seconds();
    for (int k = 0; k < 100; ++k)
        for (const double wrong_s : {-0.01, std::nan(""), std::numeric_limits<double>::infinity()})
            estimate.add(wrong_s);
    EXPECT_EQ(estimate.seconds(), before_s);
}

}  // namespace
}  // namespace livetet
