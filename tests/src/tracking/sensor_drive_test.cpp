#include "tracking/sensor_drive.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.hpp"
#include "tracking/live_registration.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;
using SensorPose = RigidTransform<ImageFrame, Sensor>;

const Vector3d placed(0.1, 0.05, 0.02), node(0.11, 0.05, 0.02);

SensorPose moved_by(const Vector3d& offset, double turn = 0) {
    return {AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix(), placed + offset};
}

SensorDrive placed_drive(SensorDriveOptions options = {}) {
    SensorDrive drive(options);
    for (int i = 0; i <= 10; ++i) drive.update(0.05 * i, moved_by(Vector3d::Zero()));
    return drive;  // following since 0.5 s
}

TEST(SensorDrive, BaseIsTheMeanOverItsWindow) {
    SensorDrive drive;
    EXPECT_EQ(drive.update(0, std::nullopt), DriveStatus::placing);
    for (int i = 0; i <= 9; ++i)
        EXPECT_EQ(drive.update(1 + 0.05 * i, moved_by(Vector3d(i % 2 ? 0.001 : -0.001, 0, 0),
                                                      i % 2 ? 0.01 : -0.01)),
                  DriveStatus::placing);
    EXPECT_EQ(drive.displacement(node), Vector3d::Zero());
    EXPECT_FALSE(drive.base());
    EXPECT_EQ(drive.update(1.5, moved_by(Vector3d::Zero())), DriveStatus::following);
    EXPECT_LT((drive.base()->translation - placed).norm(), 1e-12);
    EXPECT_LT((drive.base()->rotation - Eigen::Matrix3d::Identity()).norm(), 1e-12);
}

TEST(SensorDrive, TheBaseIsOfOnePlace) {
    SensorDriveOptions options;
    options.base_window_s = 1;
    const Vector3d elsewhere(0.03, 0, 0);
    SensorDrive drive(options);
    drive.update(0, moved_by(elsewhere));  // seen elsewhere, then lost for ten seconds
    for (double t = 0.05; t < 10; t += 0.05) drive.update(t, std::nullopt);
    const auto rest = [&](double from_s, const Vector3d& place) {
        for (int i = 0; i <= 21; ++i) drive.update(from_s + 0.05 * i, moved_by(place));
    };
    EXPECT_EQ(drive.update(10, moved_by({0.004, 0, 0})), DriveStatus::placing)
        << "one pose of the new place is no mean";
    rest(10, {0.004, 0, 0});
    ASSERT_TRUE(drive.base());
    EXPECT_LT((drive.base()->translation - placed - Vector3d(0.004, 0, 0)).norm(), 1e-12);

    drive.reset();
    for (int i = 0; i < 10; ++i) drive.update(0.05 * i, moved_by(elsewhere));
    rest(0.5, Vector3d::Zero());  // moved during the averaging, while visible
    ASSERT_TRUE(drive.base());
    EXPECT_LT((drive.base()->translation - placed).norm(), 1e-12);
}

TEST(SensorDrive, ASensorThatDoesNotRestIsNotPlacedAndSaysSo) {
    SensorDrive drive;
    EXPECT_FALSE(drive.is_restless());
    for (double t = 0; t < 3; t += 0.05)
        EXPECT_EQ(drive.update(t, moved_by({0.012 * t, 0, 0})), DriveStatus::placing) << t;
    EXPECT_TRUE(drive.is_restless()) << "6 mm in each window";
    for (double t = 3; t < 4; t += 0.05) drive.update(t, moved_by({0.036, 0, 0}));
    EXPECT_EQ(drive.status(), DriveStatus::following);
    EXPECT_FALSE(drive.is_restless());
    EXPECT_LT(drive.displacement(node).norm(), 2e-3) << "its base is where it rests";
}

TEST(SensorDrive, TranslationIgnoresTurnsAndRigidMotionFollowsThem) {
    SensorDrive drive = placed_drive();
    drive.update(0.55, moved_by({0, 0, -0.015}, 0.3));
    EXPECT_LT((drive.displacement(node) - Vector3d(0, 0, -0.015)).norm(), 1e-15);
    SensorDriveOptions options;
    options.motion = DriveMotion::rigid;
    SensorDrive rigid = placed_drive(options);
    const SensorPose now = moved_by({0, 0, -0.015}, 0.3);
    rigid.update(0.55, now);
    const Vector3d moved = now * (moved_by(Vector3d::Zero()).inverse() * node);
    EXPECT_LT((rigid.displacement(node) - (moved - node)).norm(), 1e-14);
    EXPECT_GT((rigid.displacement(node) - drive.displacement(node)).norm(), 0.002);
}

TEST(SensorDrive, MovingTheOrganAsAWholeDeformsNothing) {
    SimulatedTrackerOptions options;
    options.position_rms_mm = options.rotation_rms_deg = 0;
    options.image_from_reference.translation = Vector3d(0.05, 0.02, 0.03);
    options.image_from_sensor_at_rest.translation = placed;
    options.press_direction = Vector3d(1, 2, -2);
    LiveRegistration live(options.image_from_reference);
    SensorDrive drive;
    double deepest = 0;
    for (const TrackerSample& s : simulate_press(options).samples) {
        live.update(s.time_s, s.poses[0]);
        drive.update(s.time_s, *live.image_from_tracker() * tracker_from<Sensor>(s.poses[1]));
        const Vector3d expected = true_press_depth(options, s.time_s) * Vector3d(1, 2, -2) / 3;
        EXPECT_LT((drive.displacement(node) - expected).norm(), 1e-12) << s.time_s;
        deepest = std::max(deepest, drive.displacement(node).norm());
    }
    EXPECT_NEAR(deepest, 0.015, 1e-12);
}

TEST(SensorDrive, LostSensorHoldsThenItsPatchIsLetGoLittleByLittle) {
    SensorDrive drive = placed_drive();
    const Vector3d pressed(0, 0, -0.015);
    drive.update(0.6, moved_by(pressed));
    const SensorPose broken{Eigen::Matrix3d::Identity(), {std::nan(""), 0, 0}};
    EXPECT_EQ(drive.update(0.7, broken), DriveStatus::holding);
    EXPECT_EQ(drive.update(1.09, std::nullopt), DriveStatus::holding);
    EXPECT_EQ(drive.grip(), 1);
    double last = 1;
    for (double t = 1.11; t < 2.095; t += 0.01) {
        EXPECT_EQ(drive.update(t, std::nullopt), DriveStatus::releasing) << t;
        EXPECT_NEAR(last - drive.grip(), 0.01, 1e-9 + (last == 1 ? 0.01 : 0)) << t;
        EXPECT_LT((drive.displacement(node) - pressed).norm(), 1e-15) << "what it still pulls to";
        last = drive.grip();
    }
    EXPECT_EQ(drive.update(2.2, std::nullopt), DriveStatus::released);
    EXPECT_EQ(drive.grip(), 0);
}

TEST(SensorDrive, APoseFartherThanTheOrganCouldGoCountsAsMissing) {
    SensorDriveOptions options;
    options.max_displacement = 0.05;
    SensorDrive drive = placed_drive(options);
    const Vector3d pressed(0, 0, -0.015);
    drive.update(0.6, moved_by(pressed));
    EXPECT_EQ(drive.update(0.65, moved_by({0.051, 0, 0})), DriveStatus::holding);
    EXPECT_LT((drive.displacement(node) - pressed).norm(), 1e-15);
    EXPECT_TRUE(drive.is_too_far());
    EXPECT_EQ(drive.update(1.6, moved_by({0.051, 0, 0})), DriveStatus::releasing);
    EXPECT_EQ(drive.update(1.61, moved_by(pressed)), DriveStatus::returning);
    for (int i = 1; i <= 40; ++i) drive.update(1.61 + 0.05 * i, moved_by(pressed));
    EXPECT_EQ(drive.status(), DriveStatus::following);
    EXPECT_EQ(drive.grip(), 1);
}

TEST(SensorDrive, ReturningSensorIsCaughtUpWithAtALimitedSpeed) {
    for (const double away : {0.2, 0.9, 3.0}) {
        SensorDrive drive = placed_drive();
        drive.update(0.6, moved_by({0, 0, 0.002}));
        double t = 0.6;
        for (; t < 0.6 + away; t += 0.02) drive.update(t, std::nullopt);
        Vector3d last = drive.displacement(node);
        DriveStatus status = drive.status();
        for (int i = 0; i < 20; ++i, t += 0.02) {
            status = drive.update(t, moved_by({0, 0, -0.02}));
            EXPECT_LE((drive.displacement(node) - last).norm(), 0.1 * 0.02 + 1e-12);
            last = drive.displacement(node);
            if (i == 0) {
                EXPECT_EQ(status, DriveStatus::returning);
            }
        }
        EXPECT_LT((last - Vector3d(0, 0, -0.02)).norm(), 1e-15);
        EXPECT_EQ(status, away < 2 ? DriveStatus::following : DriveStatus::returning)
            << "not yet a second held again";
    }
}

TEST(SensorDrive, TimesThatStandStillOrGoBackDoNoHarm) {
    SensorDrive drive = placed_drive();
    drive.update(0.6, moved_by({0, 0, -0.01}));
    drive.update(0.2, std::nullopt);
    EXPECT_EQ(drive.status(), DriveStatus::holding);
    drive.update(0.6, moved_by({0, 0, -0.01}));
    EXPECT_LT((drive.displacement(node) - Vector3d(0, 0, -0.01)).norm(), 1e-15);
    drive.reset();
    EXPECT_EQ(drive.status(), DriveStatus::placing);
    SensorDriveOptions bad;
    bad.max_return_speed = 0;
    EXPECT_THROW(SensorDrive{bad}, Error);
}

}  // namespace
}  // namespace livetet
