#include "geometry/umeyama.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <string>

#include "support/points.hpp"

namespace livetet {
namespace {

using namespace test;

TEST(Umeyama, FindsTheTransformOfExactPoints) {
    Random random(1);
    for (int trial = 0; trial < 50; ++trial) {
        const Truth truth{trial % 2 ? 1.0 : 0.3 + 0.1 * trial, random.rotation(),
                          random.vector(0.5)};
        const Points p = random.points(3 + trial % 6, 0.1), x = mapped(truth, p);
        const PointFit fit = fit_points(p, x, Scaling::similarity);
        EXPECT_NEAR(fit.scale, truth.scale, 1e-12);
        EXPECT_LT((fit.rotation - truth.rotation).norm(), 1e-10);
        EXPECT_LT((fit.translation - truth.translation).norm(), 1e-11);
        EXPECT_LT(fit.fre, 1e-12);
    }
}

TEST(Umeyama, AgreesWithHornOnNoisyPoints) {
    Random random(2);
    for (const Scaling scaling : {Scaling::rigid, Scaling::similarity})
        for (int trial = 0; trial < 50; ++trial) {
            const Truth truth{1.1, random.rotation(), random.vector(0.5)};
            const Points p = random.points(6, 0.1);
            Points x = mapped(truth, p);
            for (Vector3d& point : x) point += random.gaussian(0.003);
            const std::vector<double> weights{1, 2, 0.5, 1, 3, 0.1};
            const PointFit a = fit_points(p, x, scaling, weights),
                           b = fit_points_horn(p, x, scaling, weights);
            EXPECT_LT((a.rotation - b.rotation).norm(), 1e-10);
            EXPECT_LT((a.translation - b.translation).norm(), 1e-11);
            EXPECT_NEAR(a.scale, b.scale, 1e-11);
            EXPECT_NEAR(a.fre, b.fre, 1e-13);
            EXPECT_GT(a.fre, 1e-3);
        }
}

TEST(Umeyama, TurnsUmeyamasMirroredTriangleOutOfItsPlane) {
    // Umeyama (1991), section IV, is two-dimensional: p = (0,0) (1,0) (0,2), x = (0,0) (-1,0)
    // (0,2). Without a third dimension the best rotation has no reflection: R = [0.832 0.555;
    // -0.555 0.832], s = 0.721, t = (-0.8, 0.4). In three dimensions the mirror image in the plane
    // is a half turn out of it, and the fit is exact.
    const Points p{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}}, x{{0, 0, 0}, {-1, 0, 0}, {0, 2, 0}};
    const PointFit fit = fit_points(p, x, Scaling::similarity);
    EXPECT_LT(fit.fre, 1e-14);
    EXPECT_LT((fit.rotation - Matrix3d(Vector3d(-1, 1, -1).asDiagonal())).norm(), 1e-12);
}

TEST(Umeyama, NeverReflects) {
    Random random(3);
    for (int trial = 0; trial < 50; ++trial) {
        const Points p = random.points(5, 0.1);
        Points mirrored = p;
        for (Vector3d& point : mirrored) point.x() = -point.x();
        const PointFit fit = fit_points(p, mirrored, Scaling::rigid);
        EXPECT_NEAR(fit.rotation.determinant(), 1, 1e-12);
        EXPECT_GT(fit.fre, 1e-3);
        EXPECT_NEAR(fit.fre, fit_points_horn(p, mirrored, Scaling::rigid).fre, 1e-12);
    }
}

TEST(Umeyama, FitsPointsInAPlane) {
    Random random(4);
    Points p = random.points(4, 0.1);
    for (Vector3d& point : p) point.z() = 0.02;
    const Truth truth{1, random.rotation(), random.vector(0.5)};
    const PointFit fit = fit_points(p, mapped(truth, p), Scaling::rigid);
    EXPECT_LT((fit.rotation - truth.rotation).norm(), 1e-10);
}

TEST(Umeyama, RigidFitKeepsTheScale) {
    Random random(5);
    const Points p = random.points(5, 0.1);
    const Truth truth{1.02, random.rotation(), random.vector(0.5)};
    const auto fit = register_points<ImageFrame, Tracker>(p, mapped(truth, p));
    EXPECT_EQ(fit.to_from_from.scale, 1);
    EXPECT_GT(fit.fre, 1e-4);
    EXPECT_LT((rigid_part(fit.to_from_from).rotation - truth.rotation).norm(), 1e-10);
    const auto scaled =
        register_points<ImageFrame, Tracker>(p, mapped(truth, p), Scaling::similarity);
    EXPECT_THROW(rigid_part(scaled.to_from_from), Error);
    EXPECT_LT((scaled.to_from_from.inverse() * (scaled.to_from_from * p[0]) - p[0]).norm(), 1e-14);
}

TEST(Umeyama, PointOfNoWeightDoesNotMatter) {
    Random random(6);
    const Points p = random.points(5, 0.1);
    const Truth truth{1, random.rotation(), random.vector(0.5)};
    Points x = mapped(truth, p);
    x[2] += Vector3d(0.05, 0, 0);
    const std::vector<double> weights{1, 1, 0, 1, 1};
    const PointFit fit = fit_points(p, x, Scaling::rigid, weights);
    EXPECT_LT((fit.rotation - truth.rotation).norm(), 1e-10);
    EXPECT_NEAR(fit.residuals[2].x(), -0.05, 1e-12);
    EXPECT_LT(fit.fre, 1e-12);
}

TEST(Umeyama, RefusesPointsThatDetermineNothing) {
    const Points good{{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}};
    for (const double off : {0.0, 1e-12, 1e-8, 1e-5, 5e-4}) {  // metres off the line of 0.3 m
        const Points line{{0, 0, 0}, {0.1, off, 0}, {0.2, 0, off}, {0.3, 0, 0}};
        const auto text = message_of([&] { fit_points(line, good, Scaling::rigid); });
        EXPECT_NE(text.find("points to move lie on a line"), std::string::npos) << text;
        EXPECT_NE(text.find("expected at least 0.01"), std::string::npos) << text;
        EXPECT_NE(message_of([&] {
                      fit_points_horn(good, line, Scaling::rigid);
                  }).find("points to move to lie"),
                  std::string::npos);
    }
    const Points bent{{0, 0, 0}, {0.1, 0.01, 0}, {0.2, 0, 0.01}, {0.3, 0, 0}};
    EXPECT_NO_THROW(fit_points(bent, good, Scaling::rigid));
    const Points same(4, Vector3d(1, 2, 3));
    EXPECT_NE(message_of([&] { fit_points(same, good, Scaling::rigid); }).find("coincide"),
              std::string::npos);
}

TEST(Umeyama, RefusesBadArguments) {
    const Points good{{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}};
    const Points three(good.begin(), good.begin() + 3), two(good.begin(), good.begin() + 2);
    EXPECT_NE(
        message_of([&] { fit_points(good, three, Scaling::rigid); }).find("4 points to move and 3"),
        std::string::npos);
    EXPECT_NE(message_of([&] {
                  fit_points(two, two, Scaling::rigid);
              }).find("2 points, expected at least 3"),
              std::string::npos);
    EXPECT_THROW(fit_points({}, {}, Scaling::rigid), Error);
    for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
        Points points = good;
        points[1].y() = bad;
        EXPECT_NE(
            message_of([&] { fit_points(good, points, Scaling::rigid); }).find("point 2 of 4"),
            std::string::npos);
    }
    EXPECT_THROW(fit_points(good, good, Scaling::rigid, std::vector<double>{1, 1, 1}), Error);
    EXPECT_THROW(fit_points(good, good, Scaling::rigid, std::vector<double>{1, 1, 1, -1}), Error);
    EXPECT_THROW(fit_points(good, good, Scaling::rigid, std::vector<double>{1, 1, 0, 0}), Error);
}

TEST(Umeyama, IsCheckedByHornsMethod) {
    Random random(15);
    const std::vector<double> weights{1, 2, 0.5, 0, 3};
    for (int trial = 0; trial < 50; ++trial) {
        const Points p = random.points(5, 0.1);
        Points x = mapped(Truth{1, random.rotation(), random.vector(0.5)}, p);
        for (Vector3d& point : x) point += random.gaussian(0.003);
        const PointFit fit = fit_points_cross_checked(p, x, Scaling::rigid, weights);
        EXPECT_EQ(fit.fre, fit_points(p, x, Scaling::rigid, weights).fre);
        PointFit other = fit;
        other.translation.x() += 1e-7;
        other.fre += 1e-7;
        const auto text = message_of([&] { check_agreement(fit, other, p, x); });
        EXPECT_NE(text.find("Umeyama's fit and Horn's put a point 0.0001 mm apart"),
                  std::string::npos)
            << text;
    }
}

TEST(Umeyama, SaysWhereNoRotationIsTheBest) {
    // A regular tetrahedron and its mirror image: H is a multiple of -I, so all half turns fit
    // equally well.
    const Points p{
        {0.05, 0.05, 0.05}, {0.05, -0.05, -0.05}, {-0.05, 0.05, -0.05}, {-0.05, -0.05, 0.05}};
    Points mirrored = p;
    for (Vector3d& point : mirrored) point = -point;
    // Which of them a method takes is up to its rounding: two that differ are told.
    PointFit one = fit_points(p, mirrored, Scaling::rigid), other = one;
    one.rotation = Vector3d(1, -1, -1).asDiagonal();
    other.rotation = Vector3d(-1, 1, -1).asDiagonal();
    const auto text = message_of([&] { check_agreement(one, other, p, mirrored); });
    EXPECT_NE(text.find("two rotations fit equally well"), std::string::npos) << text;
}

}  // namespace
}  // namespace livetet
