#include "tracking/rest_average.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <random>

namespace livetet {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using State = RestAverage::State;

constexpr double rate_Hz = 40;

/// Time at which a sensor that moves like that is placed; nothing within 20 s.
std::optional<double> placed_s(RestAverage& average,
                               const std::function<Vector3d(double time_s)>& place) {
    for (double t = 0; t < 20; t += 1 / rate_Hz)
        if (average.add(t, {Matrix3d::Identity(), place(t)}) == State::complete) return t;
    return std::nullopt;
}

TEST(RestAverage, OfASensorAtRestIsDoneAfterItsWindow) {
    RestAverage average({.window_s = 1});
    const Vector3d there(0.1, 0.2, 0.3);
    EXPECT_NEAR(placed_s(average, [&](double) { return there; }).value(), 1, 1e-9);
    EXPECT_LT((average.mean().translation - there).norm(), 1e-15);
}

TEST(RestAverage, WaitsForASensorThatMovesWithinItsScatter) {
    for (const double speed : {0.006, 0.009, 0.05}) {  // m/s; 6 and 9 mm in the window
        RestAverage average({.window_s = 1});
        EXPECT_FALSE(placed_s(average, [&](double t) { return Vector3d(speed * t, 0, 0); }))
            << speed << " m/s";
        EXPECT_EQ(average.state(), State::moving);
    }
    RestAverage swings({.window_s = 1});
    EXPECT_FALSE(placed_s(swings, [](double t) {
        return Vector3d(0, 0.006 * std::sin(2 * M_PI * t), 0);
    })) << "to and fro by 6 mm, once a second: no drift from end to end";
}

TEST(RestAverage, IsOfTheRestAndNotOfTheWayThere) {
    RestAverage average({.window_s = 1});
    const auto done =
        placed_s(average, [](double t) { return Vector3d(t < 3 ? 0.008 * (3 - t) : 0, 0, 0); });
    ASSERT_TRUE(done);
    EXPECT_GE(*done, 3.5);
    EXPECT_LE(*done, 4.3) << "a quarter at a time is forgotten, not all";
    EXPECT_LT(average.mean().translation.norm(), 0.002);
}

TEST(RestAverage, NoiseIsNoMotion) {
    std::mt19937 engine(1);
    std::normal_distribution<double> normal(0, 2.3e-3 / std::sqrt(3));  // RMS 2.3 mm
    int late = 0;
    for (int i = 0; i < 200; ++i) {
        RestAverage average({.window_s = 1});
        const auto done = placed_s(average, [&](double) {
            return Vector3d(normal(engine), normal(engine), normal(engine));
        });
        ASSERT_TRUE(done);
        late += *done > 1.01;
    }
    EXPECT_LT(late, 6) << "of 200";
}

TEST(RestAverage, WithoutAWindowTheFirstPoseIsTaken) {
    RestAverage average({.window_s = 0});
    EXPECT_EQ(average.add(5, {Matrix3d::Identity(), {1, 2, 3}}), State::complete);
    EXPECT_EQ(average.mean().translation, Vector3d(1, 2, 3));
}

}  // namespace
}  // namespace livetet
