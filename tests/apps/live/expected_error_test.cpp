#include "apps/live/expected_error.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/registration_covariance.hpp"
#include "geometry/registration_error.hpp"
#include "geometry/umeyama.hpp"
#include "support/points.hpp"
#include "support/whitened_errors.hpp"

namespace livetet {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test::Points;
using test::Random;
using test::WhitenedErrors;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double fle = 1e-4;

// Six fiducials of several weights in the frame of a reference sensor. The fifth is of weight 0.
CollectedFiducials collected(const RigidTransform<ImageFrame, Base>& image_from_base) {
    CollectedFiducials fiducials;
    FiducialRegistration& r = fiducials.registration;
    r.reference_tool = "Reference";
    r.fle = fle;
    r.image_from_base = {1, image_from_base.rotation, image_from_base.translation};
    const Points places{{0.25, 0.1, -0.3},   {0.15, 0.12, -0.3}, {0.2, 0.16, -0.29},
                        {0.21, 0.05, -0.26}, {0.3, 0.3, 0.1},    {0.2, 0.11, -0.35}};
    const double weights[] = {1, 4, 0.25, 1, 0, 2};
    for (std::size_t i = 0; i < places.size(); ++i) {
        RegisteredFiducial f;
        f.in_reference = places[i];
        f.in_image = image_from_base * places[i];
        f.weight = weights[i];
        r.fiducials.push_back(f);
    }
    return fiducials;
}

TEST(ExpectedError, OfATargetIsTheClosedFormWithoutATip) {
    Random random(71);
    const RigidTransform<ImageFrame, Base> truth{random.rotation(), random.vector(0.5)};
    CollectedFiducials fiducials = collected(truth);
    const ExpectedRegistrationError error = expected_error(fiducials);
    EXPECT_FALSE(error.holds_tip);
    const FiducialRegistration& r = fiducials.registration;
    for (const Vector3d& target : {Vector3d(0.2, 0.1, -0.3), Vector3d(0.1, 0.3, 0)}) {
        const double tre =
            expected_tre(places_in_base(r), fle, target, Scaling::rigid, weights_of(r));
        const Eigen::Matrix3d at = point_covariance(error.covariance, truth.rotation * target);
        EXPECT_NEAR(at.trace() / (tre * tre), 1, 1e-10);
    }
    // A fiducial of weight 0 has no influence.
    fiducials.registration.fiducials[4].in_reference += Vector3d(0.1, 0, 0.2);
    EXPECT_EQ(expected_error(fiducials).covariance, error.covariance);
    fiducials.registration.fiducials[4].weight = 1e-320;  // FLE^2 / w is no number
    EXPECT_LT((expected_error(fiducials).covariance - error.covariance).norm(),
              1e-12 * error.covariance.norm());
}

// The errors of fits of points that are off as the weights say, and by a tip that is off. Those of
// the tip are larger. The bound is 4.5 standard deviations.
TEST(ExpectedError, IsThatOfManyRegistrationsByATip) {
    Random random(72);
    const RigidTransform<ImageFrame, Base> truth{random.rotation(), random.vector(0.5)};
    CollectedFiducials fiducials = collected(truth);
    const FiducialRegistration& r = fiducials.registration;
    const Vector3d tip_deviation(1e-4, 2e-4, 4e-4);
    const Eigen::Matrix3d axes = random.rotation();
    fiducials.tip_covariance = axes * tip_deviation.cwiseAbs2().asDiagonal() * axes.transpose();
    for (std::size_t i = 0; i < r.fiducials.size(); ++i)  // means of rotations to and fro
        fiducials.base_from_tool.push_back(random.rotation() * Vector3d(1, 0.9, 0.9).asDiagonal());
    const ExpectedRegistrationError error = expected_error(fiducials);
    EXPECT_TRUE(error.holds_tip);
    constexpr int trials = 8000;
    WhitenedErrors<6> whitened;
    for (int trial = 0; trial < trials; ++trial) {
        Points p = places_in_base(r);
        const Vector3d tip_error = axes * tip_deviation.cwiseProduct(random.gaussian(1));
        for (std::size_t i = 0; i < p.size(); ++i) {
            const double weight = r.fiducials[i].weight;
            p[i] += random.gaussian(weight > 0 ? fle / std::sqrt(3 * weight) : 0.01);
            p[i] += fiducials.base_from_tool[i] * tip_error;
        }
        const PointFit fit = fit_points(p, places_in_image(r), Scaling::rigid, weights_of(r));
        Vector6d of_fit;
        of_fit << truth.translation - fit.translation,
            rotation_vector(truth.rotation * fit.rotation.transpose());
        whitened.add(of_fit, error.covariance);
    }
    EXPECT_LT(whitened.deviation(), 4.5 * std::sqrt(2.0 / trials));
}

}  // namespace
}  // namespace livetet
