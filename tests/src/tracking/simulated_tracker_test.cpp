#include "tracking/simulated_tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "geometry/pivot.hpp"
#include "support/points.hpp"
#include "tracking/poses.hpp"

namespace livetet {
namespace {

using Eigen::Vector3d;

SimulatedTrackerOptions noiseless() {
    SimulatedTrackerOptions options;
    options.position_rms_mm = options.rotation_rms_deg = 0;
    return options;
}

double angle_of(const Eigen::Matrix3d& rotation) { return Eigen::AngleAxisd(rotation).angle(); }

TEST(SimulatedTracker, NoiseHasTheStatedSize) {
    TrackerNoise noise(1.4e-3, 0.5 * test::degree, 7);
    double position = 0, angle = 0;
    Vector3d mean = Vector3d::Zero();
    constexpr int count = 20000;
    for (int i = 0; i < count; ++i) {
        const TrackedPose pose = noise(TrackedPose{});
        position += pose.translation.squaredNorm() / count;
        mean += pose.translation / count;
        angle += std::pow(angle_of(pose.rotation), 2) / count;
        ASSERT_LT((pose.rotation * pose.rotation.transpose() - Eigen::Matrix3d::Identity()).norm(),
                  1e-12);
    }
    EXPECT_NEAR(std::sqrt(position), 1.4e-3, 0.02 * 1.4e-3);
    EXPECT_NEAR(std::sqrt(angle), 0.5 * test::degree, 0.02 * 0.5 * test::degree);
    EXPECT_LT(mean.norm(), 4 * 1.4e-3 / std::sqrt(count));
}

TEST(SimulatedTracker, TheSameSeedGivesTheSameRecording) {
    SimulatedTrackerOptions options;
    const Recording a = simulate_press(options), b = simulate_press(options);
    options.seed = 2;
    const Recording c = simulate_press(options);
    ASSERT_EQ(a.samples.size(), b.samples.size());
    for (std::size_t i = 0; i < a.samples.size(); ++i) {
        EXPECT_EQ(a.samples[i].poses[1].translation, b.samples[i].poses[1].translation);
        EXPECT_NE(a.samples[i].poses[1].translation, c.samples[i].poses[1].translation);
    }
}

TEST(SimulatedTracker, PivotingGivesBackTheTip) {
    SimulatedTrackerOptions options = noiseless();
    const auto exact = calibrate_pivot(usable_poses(simulate_pivoting(options), "Stylus"));
    EXPECT_LT((exact.tool_from_tip.translation - options.tool_from_tip.translation).norm(), 1e-10);
    EXPECT_NEAR(exact.spread_deg, 71,
                1);  // less than 80, because opposite tilts are half a swing apart
    options.position_rms_mm = 1.4;
    options.rotation_rms_deg = 0.5;
    const auto noisy = calibrate_pivot(usable_poses(simulate_pivoting(options), "Stylus"));
    EXPECT_LT((noisy.tool_from_tip.translation - options.tool_from_tip.translation).norm(), 0.001);
    EXPECT_NEAR(noisy.rms, 0.0018, 0.0003);
}

TEST(SimulatedTracker, PressIsSmoothAndReturnsToRest) {
    const SimulatedTrackerOptions options = noiseless();
    EXPECT_EQ(true_press_depth(options, 0), 0);
    EXPECT_EQ(true_press_depth(options, options.rest_s), 0);
    for (int press = 0; press < options.presses; ++press) {
        const double begin = options.rest_s + press * 4.5;
        EXPECT_NEAR(true_press_depth(options, begin + 0.5), options.press_depth / 2, 1e-12);
        for (const double t : {1.0, 1.7, 2.5})
            EXPECT_NEAR(true_press_depth(options, begin + t), 0.015, 1e-12);
        EXPECT_NEAR(true_press_depth(options, begin + 4), 0, 1e-12);
    }
    EXPECT_EQ(true_press_depth(options, press_duration_s(options) + 1), 0);
    double fastest = 0;
    for (double t = 0; t < press_duration_s(options); t += 1e-3)
        fastest = std::max(
            fastest,
            std::abs(true_press_depth(options, t + 1e-3) - true_press_depth(options, t)) / 1e-3);
    EXPECT_NEAR(fastest, 1.875 * options.press_depth / options.ramp_s, 1e-4);
}

TEST(SimulatedTracker, OrganMovesFarBeforeItIsPressed) {
    const SimulatedTrackerOptions options = noiseless();
    double way = 0, turn = 0, rest_way = 0, rest_turn = 0;
    const auto start = true_tracker_from_image(options, 0);
    EXPECT_LT((start.translation - options.tracker_from_image_at_start.translation).norm(), 1e-15);
    for (double t = 0; t < press_duration_s(options); t += 0.02) {
        const auto now = true_tracker_from_image(options, t);
        way = std::max(way, (now.translation - start.translation).norm());
        turn = std::max(turn, angle_of(now.rotation * start.rotation.transpose()) / test::degree);
        if (t < options.rest_s) rest_way = way, rest_turn = turn;
        const auto next = true_tracker_from_image(options, t + 0.02);
        EXPECT_LT((next.translation - now.translation).norm(), 0.3 * 0.02)
            << "too fast at " << t << " s";
    }
    EXPECT_GT(way, 0.07);
    EXPECT_LE(way, 0.1);
    EXPECT_NEAR(turn, 40, 1);
    EXPECT_GT(rest_way, 0.05);
    EXPECT_GT(rest_turn, 30);
}

TEST(SimulatedTracker, SensorsStandWhereTheTruthSays) {
    SimulatedTrackerOptions options = noiseless();
    options.image_from_reference.translation = Vector3d(0.05, 0.02, 0.03);
    options.image_from_sensor_at_rest.translation = Vector3d(-0.04, 0.01, 0.06);
    const Recording recording = simulate_press(options);
    ASSERT_EQ(recording.samples.size(), 1 + 20 * press_duration_s(options));
    for (const TrackerSample& s : recording.samples) {
        const auto image_from_sensor = options.image_from_reference *
                                       tracker_from<Reference>(s.poses[0]).inverse() *
                                       tracker_from<Sensor>(s.poses[1]);
        const Vector3d expected = Vector3d(-0.04, 0.01, 0.06 - true_press_depth(options, s.time_s));
        EXPECT_LT((image_from_sensor.translation - expected).norm(), 1e-14);
    }
}

TEST(SimulatedTracker, TipRestsOnEachPoint) {
    const SimulatedTrackerOptions options = noiseless();
    const std::vector<Vector3d> points{{0, 0, 0}, {0.1, 0, 0.02}, {0, 0.1, 0}};
    for (std::size_t i = 0; i < points.size(); ++i)
        for (const double t : {0.01, 1.0, 2.99}) {
            const auto pose = true_touching_tool(options, points, touch_begins_s(options, i) + t);
            const Vector3d tip = pose * options.tool_from_tip.translation;
            EXPECT_LT((tip - options.tracker_from_image_at_start * points[i]).norm(), 1e-14);
        }
    EXPECT_EQ(simulate_touching(options, points).samples.size(), 1u + 13 * 20);
}

TEST(SimulatedTracker, TipIsAtOnePlaceOfASweepASampleOnTheMovingOrgan) {
    SimulatedTrackerOptions options = noiseless();
    options.image_from_reference.translation = {0.01, 0.02, -0.03};
    const std::vector<Vector3d> places{
        {0, 0, 0}, {0.01, 0, 0}, {0.02, 0.003, 0}, {0.02, 0.01, 0.01}};
    const Recording recording = simulate_sweep(options, places);
    ASSERT_EQ(recording.tools, (std::vector<std::string>{"Reference", "Stylus"}));
    ASSERT_EQ(recording.samples.size(), places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
        const auto image_from_tool =
            options.image_from_reference *
            tracker_from<Reference>(recording.samples[i].poses[0]).inverse() *
            tracker_from<Tool>(recording.samples[i].poses[1]);
        EXPECT_LT((image_from_tool * options.tool_from_tip.translation - places[i]).norm(), 1e-14);
    }
    EXPECT_THROW(simulate_sweep(options, {}), Error);
}

TEST(SimulatedTracker, ABladeIsLedThroughTheOrganWhileTheSensorDoesAsInAPress) {
    SimulatedTrackerOptions options = noiseless();
    options.rest_s = 4;
    const BladeStroke stroke{
        .from = {0, 0.05, 0.02}, .to = {0, -0.05, 0}, .begin_s = 1, .end_s = 3};
    const Recording recording = simulate_resection(options, stroke),
                    press = simulate_press(options);
    ASSERT_EQ(recording.tools, (std::vector<std::string>{"Reference", "Sensor", "Scalpel"}));
    ASSERT_EQ(recording.samples.size(), press.samples.size());
    for (std::size_t i = 0; i < press.samples.size(); ++i) {
        const TrackerSample& sample = recording.samples[i];
        EXPECT_EQ(sample.poses[1].translation, press.samples[i].poses[1].translation);
        const auto image_from_blade = options.image_from_reference *
                                      tracker_from<Reference>(sample.poses[0]).inverse() *
                                      tracker_from<Tool>(sample.poses[2]);
        const double done = std::clamp((sample.time_s - 1) / 2, 0.0, 1.0);
        EXPECT_LT((image_from_blade.translation - Vector3d(0, 0.05 - 0.1 * done, 0.02 * (1 - done)))
                      .norm(),
                  1e-14);
        EXPECT_LT(angle_of(image_from_blade.rotation), 1e-7);
    }
    EXPECT_THROW(simulate_resection(options, {.begin_s = 3, .end_s = 3}), Error);
}

TEST(SimulatedTracker, RefusesARateOfZero) {
    SimulatedTrackerOptions options;
    options.rate_Hz = 0;
    EXPECT_THROW(simulate_press(options), Error);
    EXPECT_THROW(tool_index(simulate_press({}), "Stylus"), Error);
}

}  // namespace
}  // namespace livetet
