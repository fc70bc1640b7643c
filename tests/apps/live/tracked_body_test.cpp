#include "apps/live/tracked_body.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "apps/live/statement_fixture.hpp"
#include "base/error.hpp"

namespace livetet {
namespace {

constexpr double carried_by = 0.05, lifted_by = 0.015;  // m/s

/// The last frame of 3.5 s: a block is carried along x all the time; its sensor rests on it for
/// 2 s, then lifts it.
Frame frame_of_moving_block(const std::optional<NumberOrAuto>& ahead_ms,
                            std::optional<double> ahead_s) {
    test::StatedBlock block;
    block.scene.track->targets.clear();
    block.scene.track->ahead_ms = ahead_ms;
    SceneBody body =
        make_body(PETSC_COMM_SELF, block.scene, MeshHierarchy(block.hierarchy), Use::track);
    TrackedBody tracked(block.scene, body, tool_finder({"Reference", "Sensor"}), {});
    Frame frame;
    for (int k = 0; k <= 140; ++k) {
        const double time_s = 0.025 * k;
        const Vector3 carried(carried_by * time_s, 0, 0),
            lifted(0, 0, lifted_by * std::max(0.0, time_s - 2));
        const auto seen_at = [](const Vector3& place) {
            return TrackedPose{Eigen::Matrix3d::Identity(), place, PoseStatus::ok};
        };
        frame = tracked.advance(
            {time_s,
             {seen_at(carried), seen_at(carried + test::StatedBlock::sensor_place() + lifted)}},
            {.ahead_s = ahead_s});
    }
    return frame;
}

TEST(TrackedBody, PredictsTheReferenceAndTheSensorsByTheTimeThatItIsGiven) {
    const Frame now = frame_of_moving_block({}, {});
    const Frame later = frame_of_moving_block(NumberOrAuto{}, 0.05);
    EXPECT_EQ(now.ahead_s, 0);
    EXPECT_EQ(later.ahead_s, 0.05);
    EXPECT_EQ(now.time_s, later.time_s);
    EXPECT_NEAR(now.tracker_from_image.translation.x(), carried_by * 3.5, 1e-4);
    EXPECT_NEAR(later.tracker_from_image.translation.x(), carried_by * 3.55, 1e-4);
    EXPECT_NEAR(now.press, lifted_by * 1.5, 1e-3) << "else the sensor is not followed";
    EXPECT_NEAR(later.press - now.press, lifted_by * 0.05, 0.25 * lifted_by * 0.05);
}

TEST(TrackedBody, AGivenTimeCountsAsThatOfTheScene) {
    const Frame given = frame_of_moving_block(NumberOrAuto{}, 0.05);
    const Frame fixed = frame_of_moving_block(NumberOrAuto{50}, {});
    EXPECT_EQ(fixed.ahead_s, 0.05);
    EXPECT_EQ(given.tracker_from_image.translation, fixed.tracker_from_image.translation);
    EXPECT_EQ(given.press, fixed.press);
    EXPECT_EQ(frame_of_moving_block(NumberOrAuto{}, {}).ahead_s, 0) << "auto without a time";
}

/// Planned places are for meshing: to correct one while a scene runs lets no patch go.
TEST(TrackedBody, ASensorWhosePlannedPlaceIsEditedIsStillFollowed) {
    test::StatedBlock block;
    block.scene.track->targets.clear();
    SceneBody body =
        make_body(PETSC_COMM_SELF, block.scene, MeshHierarchy(block.hierarchy), Use::track);
    TrackedBody tracked(block.scene, body, tool_finder({"Reference", "Sensor"}), {});
    const auto follow = [&](int from, int to) {
        for (int k = from; k < to; ++k)
            tracked.advance({0.025 * k,
                             {{Eigen::Matrix3d::Identity(), Vector3::Zero(), PoseStatus::ok},
                              {Eigen::Matrix3d::Identity(), test::StatedBlock::sensor_place(),
                               PoseStatus::ok}}});
    };
    follow(0, 100);
    ASSERT_EQ(tracked.last().sensors[0].drive, DriveStatus::following);
    const std::vector<std::int32_t> patch = tracked.driven();
    Scene edited = block.scene;
    edited.track->sensors[0].place_mm = 1e3 * test::StatedBlock::sensor_place();
    tracked.change(prepare_change(edited, body.mesh()));
    follow(100, 101);
    EXPECT_EQ(tracked.last().sensors[0].drive, DriveStatus::following);
    EXPECT_EQ(tracked.driven(), patch);
    edited.track->sensors[0].patch_radius_mm = 10;
    tracked.change(prepare_change(edited, body.mesh()));
    follow(101, 102);
    EXPECT_NE(tracked.last().sensors[0].drive, DriveStatus::following);
    edited.track->sensors[0].place_mm = {40, 40, 120};
    EXPECT_THROW(prepare_change(edited, body.mesh()), Error) << "off the body";
}

}  // namespace
}  // namespace livetet
