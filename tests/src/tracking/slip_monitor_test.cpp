#include "tracking/slip_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <random>

namespace livetet {
namespace {

using Eigen::Vector3d;

constexpr double monitored_Hz = 15;
const Vector3d upwards = Vector3d::UnitZ();

/// When an excess is told to be a slip, s; none within 10 s. `deviation`: of its noise, m, along an
/// axis.
std::optional<double> slip_told_at(const std::function<Vector3d(double time_s)>& excess,
                                   double deviation = 0, unsigned seed = 1) {
    SlipMonitor monitor;
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 10 * monitored_Hz; ++k) {
        const double time_s = k / monitored_Hz;
        Vector3d noise;
        for (double& component : noise) component = deviation * normal(engine);
        if (monitor.update(time_s, excess(time_s) + noise, upwards, deviation)) return time_s;
    }
    return {};
}

/// From 0 to 1 between 2 s and 2.5 s.
double slid_share(double time_s) { return std::clamp((time_s - 2) / 0.5, 0.0, 1.0); }

TEST(SlipMonitor, AnExcessAlongTheSurfaceIsTold) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        const auto told = slip_told_at(
            [](double t) { return Vector3d(-0.006 * slid_share(t), 0, 0); }, 0.0007, seed);
        ASSERT_TRUE(told);
        EXPECT_GT(*told, 2.25) << "not before it lasted";
        EXPECT_LT(*told, 3.0);
    }
}

TEST(SlipMonitor, APressAlongTheNormalOrTiltedByThirtyDegreesIsNot) {
    for (const double depth : {0.005, 0.01, 0.03})
        for (const double tilt_deg : {0, 15, 30}) {
            const double tilt = tilt_deg * M_PI / 180;
            EXPECT_FALSE(slip_told_at(
                [&](double t) {
                    return Vector3d(depth * slid_share(t) *
                                    Vector3d(std::sin(tilt), 0, -std::cos(tilt)));
                },
                0.0007))
                << 1e3 * depth << " mm, " << tilt_deg << " degrees";
        }
    EXPECT_TRUE(slip_told_at([](double t) {
        return Vector3d(0.008 * slid_share(t), 0, -0.005 * slid_share(t));
    })) << "the cone ends";
    EXPECT_TRUE(slip_told_at([](double t) {
        return Vector3d(0.008 * slid_share(t), 0, 0.02 * slid_share(t));
    })) << "lifted and displaced: not pressed";
}

/// A pause is no evidence: two poses beside it are two poses.
TEST(SlipMonitor, TwoPosesBesideAPauseDecideNothing) {
    SlipMonitor monitor;
    const Vector3d slid(-0.02, 0, 0);
    EXPECT_FALSE(monitor.update(0, slid, upwards, 0));
    EXPECT_FALSE(monitor.update(0.4, slid, upwards, 0));
    EXPECT_FALSE(monitor.update(0.8, slid, upwards, 0));
    EXPECT_TRUE(monitor.update(1.2, slid, upwards, 0));
}

TEST(SlipMonitor, NoiseIsNoneNorIsAnExcessThatGoesAgain) {
    for (unsigned seed = 1; seed <= 20; ++seed)
        EXPECT_FALSE(slip_told_at([](double) { return Vector3d(0.001, 0, 0); }, 0.0012, seed));
    EXPECT_FALSE(slip_told_at([](double t) {
        return Vector3d(t >= 2 && t < 2.25 ? 0.006 : 0.0, 0, 0);
    })) << "shorter than the limit";
    EXPECT_TRUE(
        slip_told_at([](double t) { return Vector3d(t >= 2 && t < 3 ? 0.006 : 0.0, 0, 0); }));
}

TEST(SlipMonitor, MoreNoiseAsksForMore) {
    const auto excess = [](double t) { return Vector3d(0.005 * slid_share(t), 0, 0); };
    SlipMonitor certain, uncertain;
    bool first = false, second = false;
    for (int k = 0; k < 60; ++k) {
        first =
            first || certain.update(k / monitored_Hz, excess(k / monitored_Hz), upwards, 0.0005);
        second =
            second || uncertain.update(k / monitored_Hz, excess(k / monitored_Hz), upwards, 0.002);
    }
    EXPECT_TRUE(first);
    EXPECT_FALSE(second);
}

TEST(SlipMonitor, APauseOrARestartForgetsWhatWasBefore) {
    const Vector3d slip(0.006, 0, 0);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    SlipMonitor paused, restarted, broken;
    for (SlipMonitor* monitor : {&paused, &restarted, &broken})
        for (const double time_s : {0.0, 0.1, 0.2})
            ASSERT_FALSE(monitor->update(time_s, slip, upwards, 0));
    EXPECT_FALSE(paused.update(5, slip, upwards, 0)) << "once in 5 s";
    restarted.restart();
    EXPECT_FALSE(restarted.update(0.35, slip, upwards, 0));
    EXPECT_FALSE(broken.update(0.25, {nan, 0, 0}, upwards, 0));
    EXPECT_TRUE(broken.update(0.35, slip, upwards, 0)) << "what is not a number was left out";
}

}  // namespace
}  // namespace livetet
