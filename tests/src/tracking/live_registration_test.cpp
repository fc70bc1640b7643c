#include "tracking/live_registration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/umeyama.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using Eigen::Vector3d;

// Fiducials with an error of 1 mm, touched while the organ is in its initial pose.
struct Scene {
    SimulatedTrackerOptions options;
    std::vector<Vector3d> in_image{
        {0.05, 0, 0}, {-0.05, 0.02, 0}, {0, 0.06, 0.01}, {0.01, -0.05, 0.04}};
    std::vector<Vector3d> in_tracker;
    Scene() {
        options.image_from_reference.translation = Vector3d(0.05, 0.02, 0.03);
        int i = 0;
        for (const Vector3d& x : in_image)
            in_tracker.push_back(options.tracker_from_image_at_start * x +
                                 0.001 * Vector3d::Unit(i++ % 3));
    }
    RigidTransform<Tracker, Reference> reference_at(double t) const {
        return true_tracker_from_image(options, t) * options.image_from_reference;
    }
    std::vector<Vector3d> in_reference() const {
        std::vector<Vector3d> points;
        for (const Vector3d& p : in_tracker) points.push_back(reference_at(0).inverse() * p);
        return points;
    }
    Registration<ImageFrame, Reference> fit() const {
        return register_points<ImageFrame, Reference>(in_reference(), in_image);
    }
    LiveRegistration registration(double hold_s = 0.5) const {
        return LiveRegistration(rigid_part(fit().to_from_from), hold_s);
    }
};

TEST(LiveRegistration, EqualsUmeyamaOnTheRebuiltFiducialsOfEachFrame) {
    const Scene scene;
    LiveRegistration live = scene.registration();
    for (double t = 0; t < 10; t += 0.37) {
        const auto tracker_from_reference = scene.reference_at(t);
        ASSERT_EQ(live.update(t, pose_of(tracker_from_reference)), RegistrationStatus::valid);
        std::vector<Vector3d> now;
        for (const Vector3d& m : scene.in_reference()) now.push_back(tracker_from_reference * m);
        const auto rebuilt = register_points<ImageFrame, Tracker>(now, scene.in_image);
        const auto& composed = *live.image_from_tracker();
        EXPECT_LT((rebuilt.to_from_from.rotation - composed.rotation).norm(), 1e-12);
        EXPECT_LT((rebuilt.to_from_from.translation - composed.translation).norm(), 1e-12);
        EXPECT_NEAR(rebuilt.fre, scene.fit().fre, 1e-12);
    }
}

TEST(LiveRegistration, FollowsTheOrgan) {
    Scene scene;
    for (std::size_t i = 0; i < scene.in_image.size(); ++i)
        scene.in_tracker[i] = scene.options.tracker_from_image_at_start * scene.in_image[i];
    LiveRegistration live = scene.registration();
    const Vector3d target(0.02, 0.01, -0.03);
    for (double t = 0; t < 10; t += 0.37) {
        live.update(t, pose_of(scene.reference_at(t)));
        const Vector3d in_tracker = true_tracker_from_image(scene.options, t) * target;
        EXPECT_LT((*live.image_from_tracker() * in_tracker - target).norm(), 1e-12);
    }
}

TEST(LiveRegistration, HoldsThenLosesAMissingReference) {
    const Scene scene;
    LiveRegistration live = scene.registration(0.5);
    EXPECT_EQ(live.update(0, TrackedPose{}), RegistrationStatus::lost);
    EXPECT_FALSE(live.image_from_tracker());
    EXPECT_EQ(live.update(1, pose_of(scene.reference_at(1))), RegistrationStatus::valid);
    const auto last = *live.image_from_tracker();
    TrackedPose broken = pose_of(scene.reference_at(1.1));
    broken.rotation(1, 1) = std::nan("");
    EXPECT_EQ(live.update(1.1, broken), RegistrationStatus::held);
    EXPECT_EQ(live.update(1.5, TrackedPose{}), RegistrationStatus::held);
    EXPECT_EQ(live.update(1.6, TrackedPose{}), RegistrationStatus::lost);
    EXPECT_EQ(live.image_from_tracker()->translation, last.translation);
    EXPECT_EQ(live.update(1.7, pose_of(scene.reference_at(1.7))), RegistrationStatus::valid);
    EXPECT_NE(live.image_from_tracker()->translation, last.translation);
}

TEST(LiveRegistration, RefusesAHoldTimeBelowZero) {
    EXPECT_THROW(LiveRegistration({}, -0.1), Error);
    EXPECT_THROW(LiveRegistration({}, std::nan("")), Error);
}

}  // namespace
}  // namespace livetet
