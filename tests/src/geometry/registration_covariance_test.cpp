#include "geometry/registration_covariance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "geometry/error_ellipsoid.hpp"
#include "geometry/registration_error.hpp"
#include "geometry/umeyama.hpp"
#include "support/points.hpp"
#include "support/whitened_errors.hpp"

namespace livetet {
namespace {

using namespace test;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Fiducials far from the origin of their frame, as a tracker's are.
const Points touched{{0.25, 0.1, -0.3},
                     {0.15, 0.12, -0.3},
                     {0.2, 0.16, -0.29},
                     {0.21, 0.05, -0.26},
                     {0.2, 0.11, -0.35}};

Matrix3d random_covariance(Random& random, double size) {
    const Matrix3d axes = random.rotation();
    return axes * Vector3d(1, 0.3, 0.1).cwiseAbs2().asDiagonal() * axes.transpose() * size * size;
}

Matrix3d root(const Matrix3d& covariance) { return covariance.llt().matrixL(); }

// Deviation of the covariance of many fits' errors (d, a) from the one stated.
double deviation_of_many_fits(const FiducialErrors& errors, const std::vector<double>& weights,
                              int trials, unsigned seed) {
    Random random(seed);
    const Truth truth{1, random.rotation(), random.vector(0.5)};
    const Points x = mapped(truth, touched);
    const Matrix6d stated = registration_covariance(touched, truth.rotation, errors, weights);
    WhitenedErrors<6> whitened;
    for (int trial = 0; trial < trials; ++trial) {
        Points p = touched, to = x;
        const Vector3d of_tip =
            root(errors.tip + 1e-30 * Matrix3d::Identity()) * random.gaussian(1);
        for (std::size_t i = 0; i < p.size(); ++i) {
            if (!errors.in_from.empty()) p[i] += root(errors.in_from[i]) * random.gaussian(1);
            if (!errors.in_to.empty()) to[i] += root(errors.in_to[i]) * random.gaussian(1);
            p[i] += errors.from_from_tool.empty() ? of_tip : errors.from_from_tool[i] * of_tip;
        }
        const PointFit fit = fit_points(p, to, Scaling::rigid, weights);
        Vector6d error;
        error << truth.translation - fit.translation,
            rotation_vector(truth.rotation * fit.rotation.transpose());
        whitened.add(error, stated);
    }
    return whitened.deviation();
}

// The errors are small, as the covariance is of first order. The bound is 4.5 standard deviations.
TEST(RegistrationCovariance, IsThatOfManyRegistrations) {
    Random random(51);
    constexpr int trials = 8000;
    const double bound = 4.5 * std::sqrt(2.0 / trials);
    FiducialErrors isotropic;
    isotropic.in_from.assign(5, 1e-9 * Matrix3d::Identity());
    FiducialErrors image_only, anisotropic, with_tip;
    for (std::size_t i = 0; i < touched.size(); ++i) {
        image_only.in_to.push_back(random_covariance(random, 4e-5));
        anisotropic.in_from.push_back(random_covariance(random, 5e-5));
        with_tip.from_from_tool.push_back(random.rotation());
    }
    anisotropic.in_to = image_only.in_to;
    with_tip.in_from = anisotropic.in_from;
    with_tip.tip = random_covariance(random, 1e-4);
    FiducialErrors unturned = with_tip;
    unturned.from_from_tool.clear();
    const std::vector<double> weights{1, 4, 0.25, 1, 2};
    for (const auto& w : {std::vector<double>{}, weights}) {
        EXPECT_LT(deviation_of_many_fits(isotropic, w, trials, 52), bound) << w.size();
        EXPECT_LT(deviation_of_many_fits(image_only, w, trials, 53), bound) << w.size();
        EXPECT_LT(deviation_of_many_fits(anisotropic, w, trials, 54), bound) << w.size();
        EXPECT_LT(deviation_of_many_fits(with_tip, w, trials, 55), bound) << w.size();
        EXPECT_LT(deviation_of_many_fits(unturned, w, trials, 56), bound) << w.size();
    }
}

TEST(RegistrationCovariance, OfATargetIsTheClosedForm) {
    Random random(57);
    const Matrix3d rotation = random.rotation();
    const double fle = 1.3e-3;
    const std::vector<double> weights{1, 4, 0.25, 0, 2};
    for (const auto& w : {std::vector<double>{}, weights})
        for (const bool in_image : {false, true}) {
            FiducialErrors errors;
            for (std::size_t i = 0; i < touched.size(); ++i) {
                const double weight = w.empty() ? 1 : std::max(w[i], 1e-3);
                (in_image ? errors.in_to : errors.in_from)
                    .push_back(fle * fle / (3 * weight) * Matrix3d::Identity());
            }
            const Matrix6d covariance = registration_covariance(touched, rotation, errors, w);
            for (const Vector3d& target : {Vector3d(0.2, 0.1, -0.3), Vector3d(0.22, 0.19, -0.33),
                                           Vector3d(0, 0, 0), Vector3d(-0.4, 0.3, 0.5)}) {
                const double tre = expected_tre(touched, fle, target, Scaling::rigid, w);
                EXPECT_NEAR(point_covariance(covariance, rotation * target).trace() / (tre * tre),
                            1, 1e-10);
            }
        }
}

TEST(RegistrationCovariance, CommonErrorOfAToolThatDoesNotTurnShiftsTheFit) {
    Random random(58);
    const Matrix3d rotation = random.rotation(), tool = random.rotation();
    FiducialErrors errors;
    errors.tip = random_covariance(random, 1e-3);
    errors.from_from_tool.assign(5, tool);
    const Matrix6d covariance = registration_covariance(touched, rotation, errors);
    const Matrix3d shift = rotation * tool * errors.tip * tool.transpose() * rotation.transpose();
    for (const Vector3d& arm : {Vector3d(0, 0, 0), Vector3d(0.1, -0.2, 0.3)})
        EXPECT_LT((point_covariance(covariance, arm) - shift).norm(), 1e-12 * shift.norm());
    errors.from_from_tool[1] *= -1;  // an opposite error at one point turns the fit
    const Matrix6d turned = registration_covariance(touched, rotation, errors);
    EXPECT_GT((turned.bottomRightCorner<3, 3>().norm()), 1e-6);
}

TEST(RegistrationCovariance, OfAPointTurnsAboutTheOrigin) {
    // A turn by 0.01 rad about z moves a point at x = 0.1 m by 1 mm along y.
    Matrix6d covariance = Matrix6d::Zero();
    covariance(5, 5) = 1e-4;
    EXPECT_LT(
        (point_covariance(covariance, {0.1, 0, 0}) - Matrix3d(Vector3d(0, 1e-6, 0).asDiagonal()))
            .norm(),
        1e-18);
    // With d_y = -0.1 a_z the point stays where it is.
    covariance(1, 1) = 1e-6;
    covariance(1, 5) = covariance(5, 1) = -1e-5;
    EXPECT_LT(point_covariance(covariance, {0.1, 0, 0}).norm(), 1e-18);
}

TEST(RegistrationCovariance, OfAPointFarFromTheOriginIsACovariance) {
    Random random(59);
    for (int trial = 0; trial < 20; ++trial) {
        Points far = touched;
        const Vector3d shift = random.vector(300);
        for (Vector3d& p : far) p += shift;
        FiducialErrors errors;
        errors.in_from.assign(5, 1e-7 * Matrix3d::Identity());
        const Matrix3d rotation = random.rotation();
        const Matrix3d at_centre = point_covariance(registration_covariance(far, rotation, errors),
                                                    rotation * (shift + Vector3d(0.2, 0.1, -0.3)));
        EXPECT_EQ(message_of([&] { check_covariance(at_centre, "far"); }), "no error");
        EXPECT_LT((at_centre - 2e-8 * Matrix3d::Identity()).norm(), 1e-9);
    }
}

std::string covariance_error(const Points& from, const FiducialErrors& errors,
                             const Matrix3d& rotation = Matrix3d::Identity(),
                             const std::vector<double>& weights = {}) {
    return message_of([&] { (void)registration_covariance(from, rotation, errors, weights); });
}

TEST(RegistrationCovariance, RefusesPointsThatDetermineNoRotation) {
    const Points line{{0, 0, 0}, {0.1, 0, 0}, {0.2, 0, 0}, {0.4, 0, 0}};
    EXPECT_NE(covariance_error(line, {}).find("the 4 points to move lie on a line"),
              std::string::npos);
    EXPECT_NE(covariance_error({line[0], line[1]}, {}).find("2 points, expected at least 3"),
              std::string::npos);
    EXPECT_NE(covariance_error(touched, {}, Matrix3d::Identity(), {1, 1, 0, 0, 0})
                  .find("2 points of some weight, expected at least 3"),
              std::string::npos);
}

TEST(RegistrationCovariance, RefusesBadErrorsInOneLine) {
    FiducialErrors errors;
    errors.in_from.assign(4, Matrix3d::Zero());
    EXPECT_EQ(covariance_error(touched, errors),
              "registration: 4 covariances of the points to move for 5 points, expected one each "
              "or none");
    errors.in_from.assign(5, Matrix3d::Zero());
    errors.in_from[2](1, 1) = -1e-6;
    EXPECT_EQ(covariance_error(touched, errors),
              "registration: point 3 of 5 to move: the covariance has the eigenvalue -1 mm^2, "
              "expected none below 0");
    errors.in_from.clear();
    errors.in_to.assign(5, Matrix3d::Zero());
    errors.in_to[4](0, 1) = 2e-6;
    EXPECT_EQ(covariance_error(touched, errors),
              "registration: point 5 of 5 to move to: the covariance has 0 mm^2 at (2, 1) and 2 at "
              "(1, 2), "
              "expected equal");
    errors.in_to.clear();
    errors.tip(0, 0) = std::nan("");
    EXPECT_EQ(covariance_error(touched, errors),
              "registration: the tip: the covariance has an entry that is not finite");
    errors.tip.setZero();
    errors.from_from_tool.assign(5, Matrix3d::Identity());
    errors.from_from_tool[1] *= 1.5;
    EXPECT_EQ(covariance_error(touched, errors),
              "registration: the tool's rotation at point 2 of 5 has columns of RMS length 1.5, "
              "expected a rotation or a mean of rotations");
    errors.from_from_tool[1] *= 0.5;
    EXPECT_EQ(covariance_error(touched, errors), "no error");
    for (const double scale : {-1.0, 1.01})
        EXPECT_NE(covariance_error(touched, errors, scale * Matrix3d::Identity())
                      .find("expected a rotation"),
                  std::string::npos);
}

}  // namespace
}  // namespace livetet
