#include "geometry/error_ellipsoid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "support/points.hpp"

namespace livetet {
namespace {

using namespace test;

// With standard deviations s along the columns of a rotation.
Matrix3d covariance_of(const Vector3d& s, const Matrix3d& axes = Matrix3d::Identity()) {
    return axes * s.cwiseAbs2().asDiagonal() * axes.transpose();
}

TEST(ErrorEllipsoid, RadiusIsThatOfTablesInOneTwoAndThreeDimensions) {
    // Square roots of chi-square's 0.95 quantiles with 1, 2 and 3 degrees of freedom.
    const double s = 0.002;
    EXPECT_NEAR(error_ellipsoid(covariance_of({0, s, 0})).radius_95, 1.9599640 * s, 1e-7 * s);
    EXPECT_NEAR(error_ellipsoid(covariance_of({s, 0, s})).radius_95, 2.4477468 * s, 1e-7 * s);
    EXPECT_NEAR(error_ellipsoid(covariance_of({s, s, s})).radius_95, 2.7954835 * s, 1e-7 * s);
    EXPECT_EQ(error_ellipsoid(Matrix3d::Zero()).radius_95, 0);
}

TEST(ErrorEllipsoid, SphereContainsNinetyFivePercentOfSamples) {
    Random random(41);
    constexpr int samples = 40000;
    for (const Vector3d& s :
         {Vector3d(1, 1, 1), Vector3d(1, 0.8, 0.6), Vector3d(1, 1, 0.01), Vector3d(1, 0.7, 0),
          Vector3d(1, 0.1, 0.1), Vector3d(1, 0.01, 0.001), Vector3d(0.3, 1, 0.31)}) {
        const Matrix3d axes = random.rotation();
        const Matrix3d covariance = covariance_of(1e-3 * s, axes);
        const double radius = error_ellipsoid(covariance).radius_95;
        EXPECT_NEAR(probability_within(covariance, radius), 0.95, 1e-7) << s.transpose();
        double within = 0, within_half = 0;
        for (int i = 0; i < samples; ++i) {
            const double error = (axes * s.cwiseProduct(random.gaussian(1e-3))).norm();
            within += error <= radius;
            within_half += error <= radius / 2;
        }
        // 4.5 standard deviations of a count
        EXPECT_NEAR(within / samples, 0.95, 4.5 * std::sqrt(0.95 * 0.05 / samples))
            << s.transpose();
        EXPECT_NEAR(within_half / samples, probability_within(covariance, radius / 2),
                    4.5 * std::sqrt(0.25 / samples))
            << s.transpose();
    }
}

// The mean over directions u of the distribution of a chi variable, P(chi_3 <= r / sqrt(u^T C u)),
// by a fine grid: another way to the same number.
double probability_by_directions(const Vector3d& s, double radius) {
    constexpr int rings = 500, sectors = 64;
    double sum = 0;
    for (int i = 0; i < rings; ++i)
        for (int j = 0; j < sectors; ++j) {
            const double z = (i + 0.5) / rings;
            const double phi = std::numbers::pi / 2 * (j + 0.5) / sectors;
            const Vector3d u(z, std::sqrt(1 - z * z) * std::cos(phi),
                             std::sqrt(1 - z * z) * std::sin(phi));
            const double x = radius / s.cwiseProduct(u).norm();
            sum += std::erf(x / std::sqrt(2)) -
                   std::sqrt(2 / std::numbers::pi) * x * std::exp(-x * x / 2);
        }
    return sum / (rings * sectors);
}

TEST(ErrorEllipsoid, ProbabilityIsTheMeanOverDirections) {
    for (const Vector3d& s :
         {Vector3d(1, 1, 1), Vector3d(1, 0.8, 0.6), Vector3d(1, 0.9, 0.1), Vector3d(1, 0.2, 0.15)})
        for (const double radius : {0.8, 1.5, 2.5, 4.0})
            EXPECT_NEAR(probability_within(covariance_of(s), radius),
                        probability_by_directions(s, radius), 1e-5)
                << s.transpose() << ", " << radius;
    EXPECT_EQ(probability_within(Matrix3d::Identity(), -1), 0);
    EXPECT_EQ(probability_within(covariance_of({1, 1, 0}), 0), 0);
    EXPECT_EQ(probability_within(Matrix3d::Zero(), 1e-9), 1);
}

TEST(ErrorEllipsoid, SemiAxesAreThoseOfTheCovariance) {
    Random random(42);
    const Matrix3d axes = random.rotation();
    const Vector3d s(0.001, 0.003, 0.002);
    const ErrorEllipsoid e = error_ellipsoid(covariance_of(s, axes));
    EXPECT_LT((e.semi_axes - 2.7954835 * Vector3d(0.003, 0.002, 0.001)).norm(), 1e-9);
    EXPECT_NEAR(std::abs(e.axes.col(0).dot(axes.col(1))), 1, 1e-12);
    EXPECT_NEAR(std::abs(e.axes.col(1).dot(axes.col(2))), 1, 1e-12);
    EXPECT_NEAR(std::abs(e.axes.col(2).dot(axes.col(0))), 1, 1e-12);
    constexpr int samples = 40000;
    double within = 0;
    for (int i = 0; i < samples; ++i) {
        const Vector3d error = axes * s.cwiseProduct(random.gaussian(1));
        within += (e.axes.transpose() * error).cwiseQuotient(e.semi_axes).norm() <= 1;
    }
    EXPECT_NEAR(within / samples, 0.95, 4.5 * std::sqrt(0.95 * 0.05 / samples));
    for (int i = 0; i < 20; ++i)
        EXPECT_NEAR(error_ellipsoid(covariance_of(s, random.rotation())).axes.determinant(), 1,
                    1e-12);
}

TEST(ErrorEllipsoid, RefusesWhatIsNoCovariance) {
    const auto message = [](const Matrix3d& m) {
        return message_of([&] { (void)error_ellipsoid(m); });
    };
    Matrix3d m = covariance_of({0.001, 0.002, 0.003});
    EXPECT_EQ(message(m), "no error");
    m(0, 2) = 1e-6;
    EXPECT_EQ(
        message(m),
        "error ellipsoid: the covariance has 0 mm^2 at (3, 1) and 1 at (1, 3), expected equal");
    m(0, 2) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(message(m), "error ellipsoid: the covariance has an entry that is not finite");
    EXPECT_EQ(message(Vector3d(1e-6, 1e-6, -4e-9).asDiagonal()),
              "error ellipsoid: the covariance has the eigenvalue -0.004 mm^2, expected none below "
              "0");
    EXPECT_EQ(message(Vector3d(1e-6, 1e-6, -1e-16).asDiagonal()), "no error");
}

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

// Uncorrelated errors of 1 mm and 0.01 rad.
Matrix6d millimetres_and_turns() {
    return Vector6d(1e-6, 1e-6, 1e-6, 1e-4, 1e-4, 1e-4).asDiagonal();
}

std::string refusal_of(const Matrix6d& m) {
    return message_of([&] { check_covariance(m, "pose"); });
}

TEST(ErrorEllipsoid, CovarianceOfLengthsAndAnglesMayBeOfAnyScaleAndRank) {
    Random random(43);
    EXPECT_EQ(refusal_of(Matrix6d::Zero()), "no error");
    for (const double length : {1e-9, 1e-3, 1e3})
        for (int rank = 1; rank <= 6; ++rank) {
            Matrix6d sum = Matrix6d::Zero();
            for (int k = 0; k < rank; ++k) {
                Vector6d error;
                error << random.gaussian(length), random.gaussian(0.01);
                sum += error * error.transpose();
            }
            EXPECT_EQ(refusal_of(sum), "no error") << length << ", " << rank;
        }
}

TEST(ErrorEllipsoid, RefusesWhatIsNoCovarianceOfLengthsAndAngles) {
    Matrix6d m = millimetres_and_turns();
    m(0, 4) = 1e-6;
    EXPECT_EQ(refusal_of(m),
              "pose: the covariance has 0 mm rad at (5, 1) and 0.001 at (1, 5), expected equal");
    m = millimetres_and_turns();
    m(5, 4) = 1e-5;
    EXPECT_EQ(refusal_of(m),
              "pose: the covariance has 1e-05 rad^2 at (6, 5) and 0 at (5, 6), expected equal");
    m = millimetres_and_turns();
    m(1, 2) = 2e-7;
    EXPECT_EQ(refusal_of(m),
              "pose: the covariance has 0 mm^2 at (3, 2) and 0.2 at (2, 3), expected equal");
    m(2, 5) = std::numeric_limits<double>::infinity();
    EXPECT_EQ(refusal_of(m), "pose: the covariance has an entry that is not finite");
}

// Each is a small part of the largest eigenvalue in SI units, which is an angle's.
TEST(ErrorEllipsoid, NegativeVariancesAreFoundWhateverTheUnits) {
    const std::string refused =
        "pose: the covariance, scaled to correlations, has the eigenvalue -1, expected none below "
        "0";
    Matrix6d m = millimetres_and_turns();
    m(1, 1) = -1e-15;
    EXPECT_EQ(refusal_of(m), refused);
    m = millimetres_and_turns();
    m(0, 3) = m(3, 0) = 2e-5;  // a correlation of 2
    EXPECT_EQ(refusal_of(m), refused);
    m = millimetres_and_turns();
    m.topLeftCorner<3, 3>() *= 1e-10;
    m(0, 1) = m(1, 0) = 2e-16;
    EXPECT_EQ(refusal_of(m), refused);
    m = millimetres_and_turns();
    m(2, 2) = 0;
    EXPECT_EQ(refusal_of(m), "no error");
    m(2, 3) = m(3, 2) = 1e-12;  // a covariance without a variance
    EXPECT_NE(refusal_of(m).find("has the eigenvalue -99.5"), std::string::npos) << refusal_of(m);
}

}  // namespace
}  // namespace livetet
