#include "geometry/spin.hpp"

#include <gtest/gtest.h>

#include "support/points.hpp"

namespace livetet {
namespace {

using namespace test;
using Pose = RigidTransform<Tracker, Tool>;

const Vector3d shaft = Vector3d(0.1, -0.2, 1).normalized(),
               tip_off_shaft = 0.15 * shaft + Vector3d(0.002, 0, 0);

// Poses that turn about the shaft by `turn_deg` in total, with an isotropic tilt of RMS `tilt_deg`.
std::vector<Pose> turning(int count, double turn_deg, double tilt_deg, unsigned seed = 1) {
    Random random(seed);
    const Matrix3d start = random.rotation();
    std::vector<Pose> poses;
    for (int i = 0; i < count; ++i) {
        const Matrix3d tilt =
            rotation_of_vector(random.gaussian(tilt_deg * test::degree / std::sqrt(2)));
        const Matrix3d turn =
            rotation_of_vector(shaft * (turn_deg * test::degree * i / (count - 1)));
        poses.push_back({start * tilt * turn, random.vector(0.1)});
    }
    return poses;
}

double angle_deg(const Vector3d& a, const Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) / test::degree;
}

TEST(Spin, FindsTheShaftOfExactPoses) {
    for (const double turn : {100.0, 180.0, 330.0, 700.0}) {
        const auto spin = calibrate_spin(turning(100, turn, 0), tip_off_shaft);
        EXPECT_LT(angle_deg(spin.shaft_in_tool, shaft), 1e-6) << turn;
        EXPECT_NEAR(spin.shaft_in_tool.norm(), 1, 1e-12);
        EXPECT_LT(spin.tilt_deg, 1e-5);
        EXPECT_NEAR(spin.turn_deg, std::min(turn, 356.0), 5);
        EXPECT_EQ(spin.used, 100u);
    }
}

TEST(Spin, PointsToTheTipAndHasASignOfItsOwnWithoutOne) {
    const auto poses = turning(50, 300, 0);
    EXPECT_LT(angle_deg(calibrate_spin(poses, tip_off_shaft).shaft_in_tool, shaft), 1e-6);
    const auto turned = calibrate_spin(poses, -tip_off_shaft);
    EXPECT_LT(angle_deg(turned.shaft_in_tool, -shaft), 1e-6);
    EXPECT_LT(angle_deg(poses[7].rotation * turned.shaft_in_tool, turned.shaft_in_tracker), 1e-6);
    EXPECT_LT(angle_deg(calibrate_spin(poses).shaft_in_tool, shaft), 1e-6);
}

TEST(Spin, SaysTheTiltOfNoisyPosesAndStaysNearTheShaft) {
    std::vector<double> errors;
    for (unsigned seed = 1; seed <= 50; ++seed) {
        const auto spin = calibrate_spin(turning(200, 360, 2, seed), tip_off_shaft);
        EXPECT_NEAR(spin.tilt_deg, 2, 0.4);
        errors.push_back(angle_deg(spin.shaft_in_tool, shaft));
    }
    // Standard error of the mean of 200 tilts: 2 / sqrt(200) degrees.
    EXPECT_NEAR(rms(errors), 2 / std::sqrt(200), 0.06);
}

TEST(Spin, RefusesPosesThatDoNotSpan) {
    const auto text = [](const std::vector<Pose>& poses) {
        return message_of([&] { (void)calibrate_spin(poses); });
    };
    EXPECT_NE(
        text(turning(100, 60, 0)).find("cover 60.0 degrees round the shaft, expected at least 90"),
        std::string::npos);
    EXPECT_NE(text(turning(100, 0, 0.3)).find("round the shaft, expected at least 90"),
              std::string::npos);
    EXPECT_NE(text(turning(100, 330, 15))
                  .find("expected at most 5: turn the tool about its own shaft only"),
              std::string::npos);
    EXPECT_NE(text(turning(9, 330, 0)).find("9 poses to use, expected at least 10"),
              std::string::npos);
    auto poses = turning(20, 330, 0);
    poses[3].rotation(1, 1) = std::nan("");
    EXPECT_NE(text(poses).find("pose 4 of 20 is not finite"), std::string::npos);
}

TEST(Spin, TipsAxesFollowTheShaft) {
    for (const Vector3d& axis :
         {shaft, Vector3d(1, 0.1, 0), Vector3d(0, 0, -1), Vector3d(-1, 0, 0)}) {
        const auto tool_from_tip = along_shaft(tip_off_shaft, axis);
        const Matrix3d& R = tool_from_tip.rotation;
        EXPECT_LT((R.transpose() * R - Matrix3d::Identity()).norm(), 1e-12);
        EXPECT_NEAR(R.determinant(), 1, 1e-12);
        EXPECT_LT(angle_deg(R.col(2), axis), 1e-6);
        EXPECT_EQ(tool_from_tip.translation, tip_off_shaft);
        const bool along_x = std::abs(axis.normalized().x()) > 0.94;
        EXPECT_GT(R.col(0).dot(along_x ? Vector3d::UnitY() : Vector3d::UnitX()), 0.3);
    }
    EXPECT_LT(
        (along_shaft(tip_off_shaft, Vector3d::UnitZ()).rotation - Matrix3d::Identity()).norm(),
        1e-15);
}

}  // namespace
}  // namespace livetet
