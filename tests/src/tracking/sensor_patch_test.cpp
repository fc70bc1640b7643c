#include "tracking/sensor_patch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "mesh/quadratic.hpp"
#include "support/shapes.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using Eigen::Vector3d;

TrackedPose seen_at(const Vector3d& place, PoseStatus status = PoseStatus::ok) {
    return {Eigen::Matrix3d::Identity(), place, status};
}

/// A sensor in an image frame equal to the tracker's, followed every 20 ms.
struct Followed {
    SensorPatch patch{{.drive = {.base_window_s = 0.1, .max_displacement = 0.05},
                       .follower = {.filter = PoseFilterOptions{.enabled = false}}}};
    double time_s = 0;
    SensorTrouble follow(const TrackedPose& sensor,
                         const std::optional<RigidTransform<Tracker, Reference>>&
                             tracker_from_reference = RigidTransform<Tracker, Reference>{}) {
        patch.follow(time_s += 0.02, sensor, tracker_from_reference, {});
        return patch.trouble();
    }
    Followed() {
        for (int i = 0; i < 10; ++i) follow(seen_at({0.1, 0, 0}));
    }
};

TEST(SensorPatch, SaysWhyItDoesNotFollow) {
    Followed f;
    EXPECT_EQ(f.follow(seen_at({0.1, 0, 0})), SensorTrouble::none);
    for (const auto& [status, trouble] :
         std::initializer_list<std::pair<PoseStatus, SensorTrouble>>{
             {PoseStatus::missing, SensorTrouble::lost},
             {PoseStatus::invalid, SensorTrouble::invalid},
             {PoseStatus::out_of_volume, SensorTrouble::out_of_volume},
             {PoseStatus::stale, SensorTrouble::stale},
             {PoseStatus::broken, SensorTrouble::broken}})
        EXPECT_EQ(f.follow(seen_at({0.1, 0, 0}, status)), trouble);
    EXPECT_EQ(f.follow(seen_at({std::nan(""), 0, 0})), SensorTrouble::broken);
    EXPECT_EQ(f.follow(seen_at({0.1, 0, 0}), std::nullopt), SensorTrouble::no_reference);
    EXPECT_EQ(f.follow(seen_at({0.1, 0, 0})), SensorTrouble::none);
    EXPECT_EQ(f.follow(seen_at({0.9, 0, 0})), SensorTrouble::jumped);
    SensorTrouble last = SensorTrouble::none;
    for (int i = 0; i < 10; ++i) last = f.follow(seen_at({0.9, 0, 0}));
    EXPECT_EQ(last, SensorTrouble::too_far)
        << "believed, and farther than the organ could be moved";
}

/// The rotation error of a reference 0.3 m away adds to the position errors of both sensors.
TEST(SensorPatch, NoiseOfADistantReferenceIsNoJump) {
    SensorPatch patch({.drive = {.base_window_s = 0.1, .max_displacement = 0.05}});
    TrackerNoise noise(1.4e-3, 0.5 * radians_per_degree, 4);
    int jumps = 0;
    for (int i = 0; i < 4000; ++i) {
        const TrackedPose reference = noise(seen_at({0, 0, 0}));
        patch.follow(0.025 * i, noise(seen_at({0.3, 0, 0})), tracker_from<Reference>(reference),
                     {});
        jumps += patch.trouble() == SensorTrouble::jumped;
    }
    EXPECT_EQ(jumps, 0);
    EXPECT_LT(patch.quality().position_noise_ratio, 1.2);
    EXPECT_EQ(patch.drive().status(), DriveStatus::following);
}

TEST(SensorPatch, WhatIsAJumpDependsOnWhereTheSensorIsAndNotOnWhereItWasFirst) {
    SensorPatch patch({.drive = {.base_window_s = 0.1, .max_displacement = 0.05}});
    double time_s = 0;
    const auto follow = [&](double x) {
        patch.follow(time_s += 0.025, seen_at({x, 0, 0}), RigidTransform<Tracker, Reference>{}, {});
        return patch.trouble();
    };
    for (double x = 3; x > 0.1; x -= 0.01) follow(x);  // it is brought to the organ
    for (int i = 0; i < 40; ++i) follow(0.1);
    EXPECT_EQ(follow(0.1), SensorTrouble::none);
    EXPECT_EQ(follow(0.14), SensorTrouble::jumped);
}

TEST(SensorPatch, FollowsWhereTheSensorWillBe) {
    const auto moved_by = [](double ahead_s) {
        SensorPatch patch({.drive = {.base_window_s = 0.1, .max_displacement = 0.05}});
        const Vector3d place(0.1, 0, 0);
        for (int i = 0; i <= 125; ++i) {  // rests for 1 s, then goes at 20 mm/s
            const Vector3d moved(0, 0.02 * std::max(0.0, 0.02 * i - 1), 0);
            patch.follow(0.02 * i, seen_at(place + moved), RigidTransform<Tracker, Reference>{}, {},
                         ahead_s);
        }
        return patch.drive().displacement(place).y();
    };
    EXPECT_NEAR(moved_by(0), 0.03, 1e-3);
    EXPECT_NEAR(moved_by(0.1) - moved_by(0), 0.002, 4e-4);
}

TEST(SensorPatch, AReleasedPatchIsNotPressed) {
    const TetMesh block = test::block({4, 2, 2}, {0.2, 0.1, 0.1});
    const std::vector<Vector3d> rest(block.nodes.size(), Vector3d::Zero());
    Followed f;
    ASSERT_LT(f.patch.place(block, surface_nodes(block), rest, 0.02), 0.02);
    for (int i = 0; i < 10; ++i) f.follow(seen_at({0.1, 0.013, 0}));
    EXPECT_NEAR(f.patch.press(), 0.013, 1e-12);
    for (int i = 0; i < 30; ++i) f.follow(seen_at({}, PoseStatus::missing));
    EXPECT_EQ(f.patch.drive().status(), DriveStatus::releasing);
    EXPECT_NEAR(f.patch.press(), 0.013, 1e-12) << "what it still pulls to";
    for (int i = 0; i < 60; ++i) f.follow(seen_at({}, PoseStatus::missing));
    EXPECT_EQ(f.patch.drive().status(), DriveStatus::released);
    EXPECT_EQ(f.patch.press(), 0);
}

TEST(SensorPatch, OffTheSurfaceItIsNotPlacedAndSaysHowFar) {
    const TetMesh block = test::block({4, 2, 2}, {0.2, 0.1, 0.1});
    const std::vector<std::int32_t> surface = surface_nodes(block);
    const std::vector<Vector3d> rest(block.nodes.size(), Vector3d::Zero());
    Followed f;
    ASSERT_TRUE(f.patch.awaits_placement());
    const Vector3d nearest(0.1, 0, 0);
    const std::vector<Vector3d> lifted(block.nodes.size(), Vector3d(0, 0.03, 0));
    EXPECT_NEAR(f.patch.place(block, surface, lifted, 0.02), 0.03, 1e-12);
    EXPECT_FALSE(f.patch.awaits_placement());
    EXPECT_TRUE(f.patch.nodes().empty());
    for (int i = 0; i < 10; ++i) f.follow(seen_at(nearest));
    ASSERT_TRUE(f.patch.awaits_placement());
    EXPECT_NEAR(f.patch.place(block, surface, rest, 0.02), 0, 1e-12);
    EXPECT_FALSE(f.patch.nodes().empty());
}

/// A sensor on a block that is moved along its edge by 10 mm within half a second, and stays there.
/// Of that, others move the tissue of the model by a share `w`, and the patch takes the ring around
/// along by a share `K` of the rest: u = K d + (1 - K) w d.
class Moved {
  public:
    struct Shares {
        double K = 0, w = 0;
    };
    /// `known`: what the patch is told of K; none: that it moves the tissue alone.
    Moved(Shares shares, std::optional<double> known, bool may_slip = true) : shares_(shares) {
        if (known) known_ = *known * Eigen::Matrix3d::Identity();
        SensorPatchOptions options = followed.patch.options();
        options.may_slip = may_slip;
        followed.patch = SensorPatch(options);
        for (int i = 0; i < 10; ++i) follow();
        place();
    }
    /// The next frame.
    void follow() {
        followed.follow(seen_at({0.1 + moved_, 0, 0}));
        const double u = shares_.K + (1 - shares_.K) * shares_.w;
        std::fill(now_.begin(), now_.end(), Vector3d(u * moved_ + model_moved, 0, 0));
        followed.patch.judge_slip(followed.time_s, now_, known_);
    }
    /// Moves the sensor. Returns how long after the motion's begin a slip is told, s.
    std::optional<double> move() {
        const double begin_s = followed.time_s;
        for (int i = 1; i <= 100; ++i) {
            moved_ = 0.01 * std::min(1.0, i / 25.0);
            follow();
            if (followed.patch.trouble() == SensorTrouble::slipped)
                return followed.time_s - begin_s;
        }
        return {};
    }
    void place() {
        ASSERT_TRUE(followed.patch.awaits_placement());
        ASSERT_LT(followed.patch.place(block_, surface_nodes(block_), now_, 0.02), 0.02);
    }
    Followed followed;
    double model_moved = 0;  ///< of the tissue, along x, by what is not the organ's motion, m

  private:
    Shares shares_;
    std::optional<Eigen::Matrix3d> known_;
    double moved_ = 0;
    TetMesh block_ = test::block({12, 6, 6}, {0.2, 0.1, 0.1});
    std::vector<Vector3d> now_ = std::vector<Vector3d>(block_.nodes.size(), Vector3d::Zero());
};

TEST(SensorPatch, OneThatSlipsIsLetGoAndPlacedAnew) {
    Moved m({.K = 0.3}, 0.3);
    SensorPatch& patch = m.followed.patch;
    const auto told_s = m.move();
    ASSERT_TRUE(told_s);
    EXPECT_LT(*told_s, 1);
    EXPECT_EQ(patch.slips(), 1);
    const double told_at_s = m.followed.time_s;
    bool released = false;
    while (!patch.nodes().empty() && m.followed.time_s < told_at_s + 3) {
        m.follow();
        EXPECT_NE(patch.drive().status(), DriveStatus::holding) << "it holds a wrong place";
        released = released || patch.drive().status() == DriveStatus::releasing;
        if (!patch.nodes().empty()) {
            EXPECT_EQ(patch.trouble(), SensorTrouble::slipped);
        }
    }
    EXPECT_TRUE(released);
    EXPECT_NEAR(m.followed.time_s - told_at_s, 1, 0.05) << "release_s";
    EXPECT_EQ(patch.drive().status(), DriveStatus::placing);
    EXPECT_EQ(patch.press(), 0);
    EXPECT_TRUE(patch.wider_nodes().empty());
    for (int i = 0; i < 10; ++i) m.follow();
    m.place();
    EXPECT_NEAR(patch.drive().base()->translation.x(), 0.11, 1e-9) << "where it slipped to";
    EXPECT_FALSE(patch.nodes().empty());
    for (int i = 0; i < 60; ++i) m.follow();
    EXPECT_EQ(patch.trouble(), SensorTrouble::none);
    EXPECT_EQ(patch.drive().status(), DriveStatus::following);
    EXPECT_EQ(patch.slips(), 1);
}

TEST(SensorPatch, ASlipIsDetectedWhateverThePatchTakesAlong) {
    for (const double K : {0.0, 0.3, 0.6, 0.75}) {
        const auto told_s = Moved({.K = K}, K).move();
        ASSERT_TRUE(told_s) << K;
        EXPECT_LT(*told_s, 1) << K;
        EXPECT_TRUE(Moved({.K = K}, std::nullopt).move()) << K << ", the only patch";
        EXPECT_FALSE(Moved({.K = K, .w = 0.8}, K).move()) << K << ", others move the tissue";
    }
    EXPECT_FALSE(Moved({.K = 0.7}, 0).move()) << "else K is not needed";
}

/// (1 - K)^-1 would magnify what the model does not know of the ring's displacement without limit.
TEST(SensorPatch, ATissueThatGoesAlongWithThePatchAlmostWhollyTellsNothing) {
    EXPECT_FALSE(Moved({.K = 0.95}, 0.99).move());
    EXPECT_FALSE(Moved({.K = 1}, 1).move());
}

TEST(SensorPatch, OneThatRidesAlongOrMayNotSlipIsFollowed) {
    for (const auto& [w, may_slip] : {std::pair{0.8, true}, {0.0, false}}) {
        Moved m({.K = 0.3, .w = w}, 0.3, may_slip);
        EXPECT_FALSE(m.move()) << w;
        EXPECT_EQ(m.followed.patch.slips(), 0);
        EXPECT_NEAR(m.followed.patch.press(), 0.01, 1e-9);
    }
}

/// Fixed nodes have changed, and the model moves by 20 mm. Only if that is said it is no slip, or
/// if the patch is the only one; one that follows is seen from there on.
TEST(SensorPatch, WhatChangedFixedNodesMoveIsNoSlip) {
    for (const bool is_alone : {false, true}) {
        Moved m({.K = 0.3}, is_alone ? std::nullopt : std::optional(0.3));
        m.model_moved = -0.02;
        for (int i = 0; i < 40; ++i) m.follow();
        EXPECT_EQ(m.followed.patch.slips(), is_alone ? 0 : 1);
    }
    for (const bool is_said : {false, true}) {
        Moved m({.K = 0.3}, 0.3);
        for (int i = 0; i < 20; ++i) m.follow();
        m.model_moved = -0.02;
        if (is_said) m.followed.patch.leave_ring_out();
        for (int i = 0; i < 40; ++i) m.follow();
        EXPECT_EQ(m.followed.patch.slips(), is_said ? 0 : 1);
        if (is_said) {
            EXPECT_TRUE(m.move());
        }
    }
}

TEST(SensorPatch, WithoutAPatchThereIsNoSlip) {
    Followed f;
    f.patch.let_go();
    EXPECT_EQ(f.patch.slips(), 0);
    EXPECT_EQ(f.follow(seen_at({0.1, 0, 0})), SensorTrouble::none);
}

}  // namespace
}  // namespace livetet
