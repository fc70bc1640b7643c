#include "geometry/pivot.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "support/points.hpp"
#include "support/whitened_errors.hpp"

namespace livetet {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Pose = RigidTransform<Tracker, Tool>;

const Vector3d tip(0.01, -0.02, 0.15), pivot(0.3, -0.1, 0.4);

// Poses with the tip in the pivot, tilted by up to `cone_deg` to all sides.
std::vector<Pose> cone(int count, double cone_deg) {
    std::vector<Pose> poses;
    for (int i = 0; i < count; ++i) {
        const double around = 2.4 * i,
                     tilt = cone_deg * test::degree * std::sqrt((i + 0.5) / count);
        Pose pose;
        pose.rotation =
            AngleAxisd(tilt, Vector3d(std::cos(around), std::sin(around), 0)).toRotationMatrix() *
            AngleAxisd(0.7, Vector3d::UnitY()).toRotationMatrix();
        pose.translation = pivot - pose.rotation * tip;
        poses.push_back(pose);
    }
    return poses;
}

std::string pivot_error(const std::vector<Pose>& poses) {
    try {
        (void)calibrate_pivot(poses);
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

TEST(Pivot, FindsTheTipOfExactPoses) {
    for (const double half_angle : {10.0, 20.0, 40.0}) {
        const auto result = calibrate_pivot(cone(100, half_angle));
        EXPECT_LT((result.tool_from_tip.translation - tip).norm(), 1e-12);
        EXPECT_LT((result.pivot_in_tracker - pivot).norm(), 1e-12);
        EXPECT_EQ(result.rank, 6);
        EXPECT_EQ(result.used, 100u);
        EXPECT_EQ(result.rejected, 0u);
        EXPECT_NEAR(result.spread_deg, 2 * half_angle, 0.1 * half_angle);
    }
}

TEST(Pivot, LeavesOutlyingPosesOut) {
    std::vector<Pose> poses = cone(100, 30);
    std::mt19937_64 engine(3);
    std::normal_distribution<double> noise(0, 0.0005);
    for (Pose& pose : poses)
        pose.translation += Vector3d(noise(engine), noise(engine), noise(engine));
    for (const int i : {0, 1, 2, 50, 97, 98, 99}) poses[i].translation += Vector3d(0.02, 0, 0.05);
    const auto result = calibrate_pivot(poses);
    EXPECT_GE(result.rejected, 7u);
    EXPECT_LE(result.rejected, 12u);
    EXPECT_LT((result.tool_from_tip.translation - tip).norm(), 0.0005);
    EXPECT_NEAR(result.rms, 0.0005 * std::sqrt(3), 0.0002);
    PivotOptions keep_all;
    keep_all.reject_beyond_sigma.reset();
    const auto all = calibrate_pivot(poses, keep_all);
    EXPECT_EQ(all.used, 100u);
    EXPECT_GT(all.rms, 0.01);
}

// Whitened errors of many calibrations. Their covariance is I if the one stated is right.
TEST(Pivot, StatesTheCovarianceOfManyCalibrations) {
    test::Random random(31);
    const double sigma = 0.0005;
    constexpr int trials = 2000;
    PivotOptions keep_all;
    keep_all.reject_beyond_sigma.reset();
    for (const PivotOptions& options : {keep_all, PivotOptions{}}) {
        test::WhitenedErrors<6> errors;
        for (int trial = 0; trial < trials; ++trial) {
            std::vector<Pose> poses = cone(60, 20);
            for (Pose& pose : poses) pose.translation += random.gaussian(sigma);
            if (options.reject_beyond_sigma)
                for (const int i : {5, 40}) poses[i].translation.x() += 20 * sigma;
            const auto result = calibrate_pivot(poses, options);
            Eigen::Matrix<double, 6, 1> error;
            error << result.tool_from_tip.translation - tip, result.pivot_in_tracker - pivot;
            errors.add(error, *result.covariance);
        }
        EXPECT_LT(errors.deviation(), 4.5 * std::sqrt(2.0 / trials));
    }
}

TEST(Pivot, VarianceOfFewPosesIsNotTooSmall) {
    test::Random random(33);
    double found = 0, stated = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        std::vector<Pose> poses = cone(12, 20);
        for (Pose& pose : poses) pose.translation += random.gaussian(0.0005);
        PivotOptions keep_all;
        keep_all.reject_beyond_sigma.reset();
        const auto result = calibrate_pivot(poses, keep_all);
        found += (result.tool_from_tip.translation - tip).squaredNorm();
        stated += result.covariance->topLeftCorner<3, 3>().trace();
    }
    EXPECT_NEAR(stated / found, 1, 0.1);  // 0.83 if n poses counted as 3 n degrees of freedom
}

// A tool that circles slowly, with errors that last for some ten poses.
TEST(Pivot, CovarianceGrowsWithErrorsThatLast) {
    test::Random random(32);
    constexpr int trials = 100;
    double tips = 0;
    for (int trial = 0; trial < trials; ++trial) {
        std::vector<Pose> poses;
        Vector3d error = random.gaussian(0.0005);
        for (int i = 0; i < 600; ++i) {
            error = 0.9 * error + random.gaussian(std::sqrt(1 - 0.81) * 0.0005);
            const Vector3d turn = 0.5 * Vector3d(std::cos(0.03 * i), std::sin(0.03 * i), 0);
            const Matrix3d rotation = rotation_of_vector(turn);
            poses.push_back({rotation, pivot - rotation * tip + error});
        }
        const auto result = calibrate_pivot(poses);
        const Vector3d off = result.tool_from_tip.translation - tip;
        const Matrix3d covariance = result.covariance->topLeftCorner<3, 3>();
        tips += off.dot(covariance.inverse() * off) / 3 / trials;
    }
    EXPECT_GT(tips, 0.7);  // 1 up to the scatter of the estimated correlation
    EXPECT_LT(tips, 1.8);
}

TEST(Pivot, CovarianceOfExactPosesIsZero) {
    EXPECT_LT(calibrate_pivot(cone(100, 30)).covariance->norm(), 1e-24);
}

TEST(Pivot, RefusesPosesThatTurnTooLittle) {
    for (const double half_angle : {0.0, 1.0, 5.0, 7.0})
        EXPECT_NE(pivot_error(cone(100, half_angle)).find("expected at least 15.0"),
                  std::string::npos)
            << half_angle;
    EXPECT_EQ(pivot_error(cone(100, 9)), "no error");
}

TEST(Pivot, RefusesATurnAboutOneAxisEvenWithNoise) {
    std::mt19937_64 engine(5);
    std::normal_distribution<double> noise(0, 0.5 * test::degree / std::sqrt(3));
    for (const double scale : {0.0, 1.0}) {
        std::vector<Pose> poses;
        for (int i = 0; i < 200; ++i) {
            const Vector3d turn = scale * Vector3d(noise(engine), noise(engine), noise(engine));
            Pose pose;
            pose.rotation = AngleAxisd(i * test::degree, Vector3d::UnitZ()).toRotationMatrix() *
                            AngleAxisd(turn.norm(), (turn + Vector3d(0, 0, 1e-30)).normalized())
                                .toRotationMatrix();
            pose.translation = pivot - pose.rotation * tip;
            poses.push_back(pose);
        }
        EXPECT_NE(pivot_error(poses).find("more than one axis"), std::string::npos)
            << pivot_error(poses);
    }
}

TEST(Pivot, RefusesTooFewAndNotFinitePoses) {
    EXPECT_NE(pivot_error({}).find("0 poses to use, expected at least 10"), std::string::npos);
    EXPECT_NE(pivot_error(cone(9, 30)).find("9 poses"), std::string::npos);
    std::vector<Pose> poses = cone(20, 30);
    poses[4].translation.y() = std::nan("");
    EXPECT_NE(pivot_error(poses).find("pose 5 of 20 is not finite"), std::string::npos);
}

// File format: for each pose a line `# stamp`, then a 4 x 4 matrix in millimetres.
std::vector<Pose> read_poses(const std::filesystem::path& path) {
    std::ifstream in(path);
    std::vector<Pose> poses;
    for (std::string line; std::getline(in, line);) {
        if (!line.starts_with('#')) continue;
        Eigen::Matrix4d m;
        for (int k = 0; k < 16; ++k) in >> m(k / 4, k % 4);
        in.ignore(1000, '\n');
        poses.push_back({m.topLeftCorner<3, 3>(), 1e-3 * m.topRightCorner<3, 1>()});
    }
    return poses;
}

TEST(Pivot, GivesTheKnownTipOfTheRealPointer) {
    const char* data = std::getenv("LIVETET_DATA");
    const auto path = std::filesystem::path(data ? data : "") / "pivot/pivot_1151_poses_merged.txt";
    if (!data || !std::filesystem::exists(path))
        GTEST_SKIP() << "LIVETET_DATA has no " << path.filename();
    const auto poses = read_poses(path);
    ASSERT_EQ(poses.size(), 1151u);
    PivotOptions keep_all;
    keep_all.reject_beyond_sigma.reset();
    const auto all = calibrate_pivot(poses, keep_all);
    EXPECT_LT((1e3 * all.tool_from_tip.translation - Vector3d(-14.476, 395.143, -7.558)).norm(),
              1e-3);
    EXPECT_LT((1e3 * all.pivot_in_tracker - Vector3d(-805.285, -85.448, -2112.066)).norm(), 1e-3);
    EXPECT_NEAR(1e3 * all.rms, 3.184, 1e-3);
    const auto usual = calibrate_pivot(poses);
    EXPECT_GT(usual.rejected, 0u);
    EXPECT_LT(usual.rms, all.rms);
    EXPECT_LT((usual.tool_from_tip.translation - all.tool_from_tip.translation).norm(), 0.002);
}

}  // namespace
}  // namespace livetet
