#include "tracking/motion_script.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"
#include "config/yaml.hpp"
#include "geometry/pivot.hpp"
#include "geometry/transform.hpp"
#include "support/points.hpp"
#include "tracking/poses.hpp"

namespace livetet {
namespace {

using Eigen::Vector3d;

DelayedRecording simulated(const std::string& text) {
    return simulate(parse_motion_script(text, "script.yaml"));
}

const TrackedPose& pose_at(const DelayedRecording& r, double time_s, std::size_t tool = 0) {
    for (const TrackerSample& sample : r.recording.samples)
        if (std::abs(sample.time_s - time_s) < 1e-9) return sample.poses.at(tool);
    fail("no sample at {} s", time_s);
}

TEST(MotionScript, AToolOnTheOrganGoesWhereTheOrganGoes) {
    const auto r = simulated(
        "rate_Hz: 10\nduration_s: 4\n"
        "organ: {at_mm: [100, 0, 0], turn_deg: [0, 0, 90], moves: [{at_s: 1, by_mm: [0, 0, 50]}, "
        "{at_s: 3, turn_deg: [0, 0, 90]}]}\n"
        "tools: [{tool: Reference, at_mm: [20, 0, 0]}, {tool: Probe, on: tracker, at_mm: [1, 2, "
        "3]}]\n");
    ASSERT_EQ(r.recording.tools, (std::vector<std::string>{"Reference", "Probe"}));
    ASSERT_EQ(r.recording.samples.size(), 41u);
    EXPECT_LT((pose_at(r, 0).translation - Vector3d(0.1, 0.02, 0)).norm(), 1e-12);
    EXPECT_LT((pose_at(r, 0.5).translation - Vector3d(0.1, 0.02, 0.025)).norm(), 1e-12)
        << "half the way";
    EXPECT_LT((pose_at(r, 1).translation - Vector3d(0.1, 0.02, 0.05)).norm(), 1e-12);
    EXPECT_LT((pose_at(r, 3).translation - Vector3d(0.08, 0, 0)).norm(), 1e-12)
        << "turned by 90 degrees more";
    EXPECT_EQ(pose_at(r, 3).translation, pose_at(r, 4).translation) << "it stays";
    const Eigen::Matrix3d turned = rotation_of_vector(Vector3d(0, 0, 180 * test::degree));
    EXPECT_LT((pose_at(r, 4).rotation - turned).norm(), 1e-12);
    for (const TrackerSample& sample : r.recording.samples)
        EXPECT_LT((sample.poses[1].translation - Vector3d(0.001, 0.002, 0.003)).norm(), 1e-15);
}

TEST(MotionScript, MovesBeginAndEndAtRest) {
    const auto r = simulated(
        "rate_Hz: 1000\nduration_s: 2\ntools: [{tool: A, moves: [{at_s: 1, by_mm: [1000, 0, 0]}, "
        "{at_s: 2, by_mm: "
        "[0, 0, 0]}]}]");
    const auto speed = [&](double t) {
        return (pose_at(r, t + 0.001).translation - pose_at(r, t).translation).norm() / 0.001;
    };
    EXPECT_LT(speed(0), 0.01);
    EXPECT_LT(speed(0.999), 0.01);
    EXPECT_LT(speed(1), 0.01);
    EXPECT_LT(speed(1.999), 0.01);
    EXPECT_NEAR(speed(0.5), 1.875, 0.01) << "the steepest of 6 x^5 - 15 x^4 + 10 x^3";
}

TEST(MotionScript, ATipThatRestsIsFoundByPivotCalibration) {
    const auto r = simulated(
        "rate_Hz: 50\nduration_s: 8\ntools: [{tool: Stylus, on: tracker, at_mm: [10, 20, 30], "
        "tip_mm: [4, -2, 150], "
        "moves: [{at_s: 2, turn_deg: [30, 0, 0]}, {at_s: 4, turn_deg: [0, 30, 0]}, {at_s: 6, "
        "turn_deg: [-30, 0, 0]}, "
        "{at_s: 8, turn_deg: [0, -30, 60]}]}]");
    const auto c = calibrate_pivot(usable_poses(r.recording, "Stylus"));
    EXPECT_LT((c.tool_from_tip.translation - Vector3d(0.004, -0.002, 0.15)).norm(), 1e-9);
    EXPECT_LT((c.pivot_in_tracker - Vector3d(0.01, 0.02, 0.03)).norm(), 1e-9);
}

TEST(MotionScript, NoiseDropoutsAndLatencyAreAsLargeAsStatedAndTheSeedsOwn) {
    const std::string text =
        "rate_Hz: 100\nduration_s: 100\nposition_noise_mm: 2\nrotation_noise_deg: 1\ndropout_rate: "
        "0.2\n"
        "latency_ms: 40\nlatency_jitter_ms: 5\ntools: [{tool: A}]\nseed: ";
    const auto r = simulated(text + "3"), again = simulated(text + "3"),
               other = simulated(text + "4");
    double missing = 0, position = 0, angle = 0, mean = 0, deviation = 0;
    const auto n = static_cast<double>(r.recording.samples.size());
    ASSERT_EQ(r.delays_s.size(), r.recording.samples.size());
    for (std::size_t i = 0; i < r.delays_s.size(); ++i) {
        const TrackedPose& pose = r.recording.samples[i].poses[0];
        EXPECT_EQ(pose.translation, again.recording.samples[i].poses[0].translation);
        EXPECT_EQ(pose.status, again.recording.samples[i].poses[0].status);
        EXPECT_EQ(r.delays_s[i], again.delays_s[i]);
        EXPECT_NE(r.delays_s[i], other.delays_s[i]);
        mean += r.delays_s[i] / n;
        deviation += std::pow(r.delays_s[i] - 0.04, 2) / n;
        missing += pose.status == PoseStatus::missing;
        position += pose.translation.squaredNorm();
        angle += std::pow(Eigen::AngleAxisd(pose.rotation).angle(), 2);
    }
    EXPECT_NEAR(missing / n, 0.2, 0.02);
    EXPECT_NEAR(std::sqrt(position / (n - missing)), 2e-3, 0.05e-3);
    EXPECT_NEAR(std::sqrt(angle / (n - missing)), test::degree, 0.03 * test::degree);
    EXPECT_NEAR(mean, 0.04, 0.5e-3);
    EXPECT_NEAR(std::sqrt(deviation), 5e-3, 0.3e-3);
}

TEST(MotionScript, ALostToolIsMissingAndAJumpIsOneSample) {
    const auto r = simulated(
        "rate_Hz: 10\nduration_s: 3\ntools: [{tool: A, lost_s: [0.5, 1, 2, 2.1], jump_s: [1.45], "
        "jump_mm: [0, 300, "
        "0]}, {tool: B}]");
    for (std::size_t i = 0; i <= 30; ++i) {
        const auto& poses = r.recording.samples[i].poses;
        EXPECT_EQ(poses[0].status == PoseStatus::missing, (i >= 5 && i < 10) || i == 20) << i;
        EXPECT_NEAR(poses[0].translation.y(), i == 15 ? 0.3 : 0, 1e-12) << i;
        EXPECT_EQ(poses[1].status, PoseStatus::ok);
    }
    for (const double delay : r.delays_s) EXPECT_EQ(delay, 0);
}

TEST(MotionScript, WhatIsWrongIsNamedByFileAndKey) {
    const auto refused = [](const std::string& text, std::initializer_list<const char*> parts) {
        const std::string message =
            test::message_of([&] { parse_motion_script(text, "script.yaml"); });
        for (const char* part : parts)
            EXPECT_NE(message.find(part), std::string::npos) << part << " in: " << message;
    };
    refused("", {"tools", "script.yaml"});
    refused("[1, 2]", {"table of keys", "script.yaml:1"});
    refused("rate_Hz: 0\n", {"rate_Hz = 0 Hz", "greater than 0", "script.yaml:1"});
    refused("dropout_rate: 2\n", {"dropout_rate = 2", "from 0 to 1"});
    refused("tools: [{tool: A}]\nlatency: 3\n", {"latency", "latency_ms", "script.yaml:2"});
    refused("tools: [{tool: A, on: table}]", {"tools[0].on = table", "organ, tracker"});
    refused("tools: [{tool: A, lost_s: [1, 2, 3]}]", {"tools[0].lost_s", "[from, to"});
    refused("tools: [{tool: A, lost_s: [2, 1]}]", {"tools[0].lost_s", "ascending"});
    refused("tools: [{tool: A}, {tool: A}]", {"tools[1].tool = A", "twice", "script.yaml"});
    refused("tools: [{tool: A, moves: [{at_s: 2}, {at_s: 1}]}]",
            {"tools[0].moves[1].at_s = 1 s", "2 s", "script.yaml"});
    refused("tools: [{tool: A}]\norgan: {moves: [{by_mm: [1, 2, 3]}]}",
            {"organ.moves[0].at_s", "script.yaml"});
    refused("tools: [{tool: A}]\nrate_Hz: 1000\nduration_s: 1e6\n",
            {"rate_Hz = 1000", "duration_s", "script.yaml"});
    refused("tools: [{tool: A, at_mm: [1, 2]}]", {"tools[0].at_mm", "three numbers"});
    refused("tools: [", {"script.yaml:1", "not YAML"});
}

TEST(MotionScript, WrittenOutItReadsBackTheSame) {
    const auto script = parse_motion_script(
        "tools: [{tool: A, tip_mm: [0, 0, 100], moves: [{at_s: 1, turn_deg: [10, 0, 0]}], lost_s: "
        "[1, 2]}]",
        "a.yaml");
    const auto again = parse_motion_script(to_yaml(script), "b.yaml");
    const auto r = simulate(script), s = simulate(again);
    for (std::size_t i = 0; i < r.recording.samples.size(); ++i)
        EXPECT_EQ(r.recording.samples[i].poses[0].translation,
                  s.recording.samples[i].poses[0].translation);
}

}  // namespace
}  // namespace livetet
