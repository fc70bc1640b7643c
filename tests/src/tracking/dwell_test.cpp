#include "tracking/dwell.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/umeyama.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using Eigen::Vector3d;

const std::vector<Vector3d> points{
    {0, 0, 0}, {0.1, 0, 0.02}, {0, 0.1, 0}, {0.08, 0.07, 0.05}, {0.02, -0.06, 0.03}};

TEST(Dwell, FindsEachPointTouchedInNoise) {
    for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6, 7, 8})
        for (const double rate_Hz : {15.0, 20.0, 60.0}) {
            SimulatedTrackerOptions options;
            options.seed = seed;
            options.rate_Hz = rate_Hz;
            const auto dwells =
                find_dwells(simulate_touching(options, points), options.tool_from_tip);
            ASSERT_EQ(dwells.size(), points.size()) << "seed " << seed << ", " << rate_Hz << " Hz";
            for (std::size_t i = 0; i < points.size(); ++i) {
                const Vector3d truth = options.tracker_from_image_at_start * points[i];
                EXPECT_LT((dwells[i].tip_in_tracker - truth).norm(), 0.0015)
                    << i << ' ' << seed << ' ' << rate_Hz;
                const double begin = touch_begins_s(options, i),
                             middle = rate_Hz * (begin + options.dwell_s / 2);
                EXPECT_LT(dwells[i].first, middle);
                EXPECT_GT(dwells[i].last, middle);
                EXPECT_NEAR(dwells[i].scatter, 0.0018, 0.0006);
            }
        }
}

TEST(Dwell, AToolThatLiesStillOrKeepsMovingIsNoLandmark) {
    SimulatedTrackerOptions options;
    Recording lying{{"Stylus"}, {}}, moving = lying;
    TrackerNoise noise(options);
    for (int i = 0; i < 200; ++i) {
        TrackedPose pose{Eigen::Matrix3d::Identity(), {0.1, 0.2, 0.3}, PoseStatus::ok};
        lying.samples.push_back({i / 20.0, {noise(pose)}});
        pose.rotation = Eigen::AngleAxisd(0.3 * std::sin(i / 8.0), Vector3d::UnitX());
        pose.translation =
            Vector3d(0.01 * i / 20.0, 0, 0) - pose.rotation * options.tool_from_tip.translation;
        moving.samples.push_back({i / 20.0, {noise(pose)}});
    }
    EXPECT_TRUE(find_dwells(lying, options.tool_from_tip).empty());
    EXPECT_TRUE(find_dwells(moving, options.tool_from_tip).empty());
    DwellOptions any;
    any.min_turn_deg = 0;
    EXPECT_EQ(find_dwells(lying, options.tool_from_tip, any).size(), 1u);
    const std::vector<FrameWindow> window{{20, 80}};
    EXPECT_NO_THROW(dwells_in_windows(lying, options.tool_from_tip, window));
    EXPECT_THROW(dwells_in_windows(moving, options.tool_from_tip, window), Error);
}

// The organ moves, together with its reference sensor and the tool resting on it.
Recording carried(const SimulatedTrackerOptions& options) {
    Recording recording = simulate_touching(options, points);
    for (TrackerSample& s : recording.samples) {
        const auto now = true_tracker_from_image(options, s.time_s);
        const auto motion = now * options.tracker_from_image_at_start.inverse();
        for (TrackedPose& pose : s.poses)
            pose = {motion.rotation * pose.rotation, motion * pose.translation, PoseStatus::ok};
    }
    return recording;
}

TEST(Dwell, ReferenceFrameSeesStillnessOnAMovingOrgan) {
    SimulatedTrackerOptions options;
    options.position_rms_mm = 0.3;
    options.rotation_rms_deg = 0.1;
    options.image_from_reference.translation = Vector3d(0.05, 0.02, 0.03);
    const Recording recording = carried(options);
    DwellOptions in_reference;
    in_reference.reference = "Reference";
    const auto dwells = find_dwells(recording, options.tool_from_tip, in_reference);
    ASSERT_EQ(dwells.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vector3d truth = options.image_from_reference.inverse() * points[i];
        ASSERT_TRUE(dwells[i].tip_in_reference);
        EXPECT_LT((*dwells[i].tip_in_reference - truth).norm(), 0.001);
    }
    EXPECT_NE(find_dwells(recording, options.tool_from_tip).size(), points.size());
}

// A tool that turns to and fro by `angle` about the axis x of a reference, which is turned, too;
// its tip rests at the reference's origin. In every tenth frame the tool is not seen.
Recording turned_to_and_fro(const Eigen::Matrix3d& tracker_from_reference, double angle,
                            const Vector3d& tip) {
    Recording recording{{"Stylus", "Reference"}, {}};
    for (int i = 0; i < 80; ++i) {
        const Eigen::Matrix3d turn =
            tracker_from_reference *
            Eigen::AngleAxisd(i % 2 ? angle : -angle, Vector3d::UnitX()).toRotationMatrix();
        recording.samples.push_back(
            {i / 20.0,
             {{turn, -turn * tip, i % 20 < 18 ? PoseStatus::ok : PoseStatus::invalid},
              {tracker_from_reference, Vector3d::Zero(), PoseStatus::ok}}});
    }
    return recording;
}

TEST(Dwell, MeanTurnIsTheMeanOfRotationsInTheFrameOfTheTip) {
    const double angle = 0.5;
    const RigidTransform<Tool, Tip> tool_from_tip{Eigen::Matrix3d::Identity(), {0.01, -0.02, 0.15}};
    const Eigen::Matrix3d tracker_from_reference = rotation_of_vector({0.3, 1, -0.4});
    const Recording recording =
        turned_to_and_fro(tracker_from_reference, angle, tool_from_tip.translation);
    // The turns about x cancel; what is across x is shorter by cos(angle).
    const Eigen::Matrix3d mean = Vector3d(1, std::cos(angle), std::cos(angle)).asDiagonal();
    const auto dwells = find_dwells(recording, tool_from_tip);
    ASSERT_EQ(dwells.size(), 1u);
    EXPECT_EQ(dwells[0].used, 72u);
    EXPECT_LT((dwells[0].mean_turn - tracker_from_reference * mean).norm(), 1e-12);
    EXPECT_NEAR(dwells[0].turn_deg, angle * 180 / M_PI, 1e-9);

    DwellOptions in_reference;
    in_reference.reference = "Reference";
    const auto windows = dwells_in_windows(recording, tool_from_tip,
                                           std::vector<FrameWindow>{{20, 60}}, in_reference);
    EXPECT_LT((windows.at(0).mean_turn - mean).norm(), 1e-12);
    // A constant error of the tip shifts the mean by it, turned by the mean of rotations.
    const Vector3d off(0.001, 0.002, -0.003);
    const auto shifted = dwells_in_windows(
        recording,
        RigidTransform<Tool, Tip>{Eigen::Matrix3d::Identity(), tool_from_tip.translation + off},
        std::vector<FrameWindow>{{20, 60}}, in_reference);
    EXPECT_LT((*shifted.at(0).tip_in_reference - *windows.at(0).tip_in_reference -
               windows.at(0).mean_turn * off)
                  .norm(),
              1e-12);
}

TEST(Dwell, FramesNotSeenArePassedOver) {
    SimulatedTrackerOptions options;
    Recording recording = simulate_touching(options, points);
    for (std::size_t i = 0; i < recording.samples.size(); ++i) {
        if (i % 5 == 0) recording.samples[i].poses[1] = {};
        if (i % 7 == 0) recording.samples[i].poses[1].translation.x() = std::nan("");
    }
    const auto dwells = find_dwells(recording, options.tool_from_tip);
    ASSERT_EQ(dwells.size(), points.size());
    for (const Dwell& dwell : dwells) {
        EXPECT_LT(dwell.used, dwell.last - dwell.first);
        EXPECT_TRUE(dwell.tip_in_tracker.allFinite());
    }
}

TEST(Dwell, WindowsGiveTheMeanAndRefuseWhatIsNoWindow) {
    SimulatedTrackerOptions options;
    const Recording recording = simulate_touching(options, points);
    const auto call = [&](FrameWindow window) {
        return dwells_in_windows(recording, options.tool_from_tip, std::vector{window});
    };
    const auto dwells = call({100, 160});
    EXPECT_LT((dwells[0].tip_in_tracker - options.tracker_from_image_at_start * points[1]).norm(),
              0.001);
    EXPECT_EQ(dwells[0].used, 60u);
    EXPECT_FALSE(dwells[0].tip_in_reference);
    EXPECT_THROW(call({160, 160}), Error);
    EXPECT_THROW(call({100, 100000}), Error);
    EXPECT_THROW(call({40, 100}), Error);  // on the way to the next point
    EXPECT_THROW(find_dwells({{"Other"}, {}}, options.tool_from_tip), Error);
    EXPECT_TRUE(find_dwells({{"Stylus"}, {}}, options.tool_from_tip).empty());
    DwellOptions bad;
    bad.radius_mm = 0;
    EXPECT_THROW(find_dwells(recording, options.tool_from_tip, bad), Error);
}

}  // namespace
}  // namespace livetet
