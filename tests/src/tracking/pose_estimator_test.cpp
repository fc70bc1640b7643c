#include "tracking/pose_estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "base/error.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

TrackedPose posed(const Vector3d& position, double turn = 0) {
    return {AngleAxisd(turn, Vector3d(1, 2, 3).normalized()).toRotationMatrix(), position,
            PoseStatus::ok};
}

Vector3d turn_error(const PoseEstimate& estimate, const TrackedPose& truth) {
    return rotation_vector(truth.rotation * estimate.rotation.transpose());
}

/// An estimator that followed a tool at rest at the origin for 2 s of 40 Hz; the last pose is at 0.
PoseEstimator rested(const PoseEstimatorOptions& options = {}) {
    PoseEstimator estimator(options);
    for (int i = -80; i <= 0; ++i) estimator.update(i / 40.0, posed(Vector3d::Zero()));
    return estimator;
}

/// Options with one model: a plain Kalman filter.
PoseEstimatorOptions plain_kalman(double density, double turn_density) {
    PoseEstimatorOptions options;
    options.acceleration_densities.fill(density);
    options.turn_acceleration_densities.fill(turn_density);
    return options;
}

TEST(PoseEstimator, FollowsAConstantVelocityWithoutLag) {
    for (const double rate : {15.0, 40.0, 80.0}) {
        PoseEstimator estimator;
        const auto truth = [](double t) { return posed({0.1 * t, 0.02 * t, 0}, 0.5 * t); };
        double t = 0;
        for (int i = 0; i <= 30 * rate; ++i) {
            t = i / rate;
            EXPECT_NE(estimator.update(t, truth(t)), PoseVerdict::held);
        }
        for (const double ahead : {0.0, 0.1}) {
            const PoseEstimate estimate = estimator.predict(t + ahead).value();
            EXPECT_NEAR(estimate.time_s, t + ahead, 1e-12);
            EXPECT_LT((estimate.translation - truth(t + ahead).translation).norm(), 1e-6);
            EXPECT_LT(turn_error(estimate, truth(t + ahead)).norm(), 1e-6);
            EXPECT_LT((estimate.velocity - Vector3d(0.1, 0.02, 0)).norm(), 1e-6);
            EXPECT_LT((estimate.angular_velocity - 0.5 * Vector3d(1, 2, 3).normalized()).norm(),
                      1e-6);
        }
    }
}

/// Sums over seeds of the normalised estimation errors squared of translation and rotation.
struct SquaredErrors {
    double translation = 0, rotation = 0, both = 0;
    void add(const PoseEstimate& estimate, const TrackedPose& truth) {
        Eigen::Matrix<double, 6, 1> error;
        error << truth.translation - estimate.translation, turn_error(estimate, truth);
        const auto& C = estimate.covariance;
        translation += error.head<3>().dot(C.topLeftCorner<3, 3>().llt().solve(error.head<3>()));
        rotation += error.tail<3>().dot(C.bottomRightCorner<3, 3>().llt().solve(error.tail<3>()));
        both += error.dot(C.llt().solve(error));
    }
};

/// A body whose accelerations are white noise of the given densities, followed at irregular times
/// from 12 to 60 ms apart; errors `ahead_s` after the last sample.
SquaredErrors follow_random_bodies(const PoseEstimatorOptions& options, int seeds, double ahead_s,
                                   const std::function<int(double time_s)>& model) {
    SquaredErrors errors;
    for (int seed = 1; seed <= seeds; ++seed) {
        std::mt19937_64 engine(seed);
        std::normal_distribution<double> normal;
        const auto draw = [&] { return Vector3d(normal(engine), normal(engine), normal(engine)); };
        TrackerNoise noise(options.position_rms, options.rotation_rms, 1000 + seed);
        TrackedPose body = posed({0.3, 0.2, -0.1}, 1);
        Vector3d v = options.start_speed * draw(), w = options.start_turn_rate * draw();
        PoseEstimator estimator(options);
        double t = 0;
        for (int i = 0; i < 200; ++i) {
            estimator.update(t, noise(body));
            const double dt =
                i == 199 ? ahead_s : std::uniform_real_distribution<double>(0.012, 0.06)(engine);
            const double q = options.acceleration_densities[model(t)];
            const double turn_q = options.turn_acceleration_densities[model(t)];
            const Vector3d dv = std::sqrt(q * dt) * draw();
            const Vector3d dw = std::sqrt(turn_q * dt) * draw();
            body.translation += dt * (v + dv / 2) + std::sqrt(q * dt * dt * dt / 12) * draw();
            body.rotation = rotation_of_vector(dt * (w + dw / 2) +
                                               std::sqrt(turn_q * dt * dt * dt / 12) * draw()) *
                            body.rotation;
            v += dv;
            w += dw;
            t += dt;
        }
        errors.add(estimator.predict(t).value(), body);
    }
    return errors;
}

// The sum over N seeds is chi-square with 3 N (6 N) degrees of freedom; bounds at 3.3 standard
// deviations. The noise is learned as at least the stated one and therefore, by chance, as up to a
// tenth more: the lower bound has that slack.
TEST(PoseEstimator, StatesTheCovarianceOfMonteCarlo) {
    const int seeds = 200;
    const auto errors =
        follow_random_bodies(plain_kalman(1e-3, 6e-2), seeds, 0.1, [](double) { return 0; });
    const auto expect_chi_square = [](double sum, double freedom) {
        const double spread = 3.3 * std::sqrt(2 * freedom);
        EXPECT_LT(sum, freedom + spread);
        EXPECT_GT(sum, 0.9 * (freedom - spread));
    };
    expect_chi_square(errors.translation, 3 * seeds);
    expect_chi_square(errors.rotation, 3 * seeds);
    expect_chi_square(errors.both, 6 * seeds);
}

// The mixture is no Gaussian, and the sudden model never holds here: the bounds are wider.
TEST(PoseEstimator, StatesTheCovarianceWhileTheMotionChanges) {
    const int seeds = 200;
    const auto errors =
        follow_random_bodies({}, seeds, 0, [](double t) { return std::fmod(t, 3) < 1.5 ? 0 : 1; });
    EXPECT_NEAR(errors.translation / (3 * seeds), 0.9, 0.3);
    EXPECT_NEAR(errors.rotation / (3 * seeds), 0.9, 0.3);
}

/// RMS error (m) at a target 80 mm from the sensor and the lag (s) behind its motion.
struct Following {
    double rms = 0, lag_s = 0;
};

Following follow(double rate_Hz, const std::function<TrackedPose(double time_s)>& truth) {
    const Vector3d target(0.05, 0.05, 0.037);
    PoseEstimator estimator;
    TrackerNoise noise(1.4e-3, 0.5 * radians_per_degree, 5);
    const auto place = [&](double t) -> Vector3d {
        const TrackedPose pose = truth(t);
        return pose.rotation * target + pose.translation;
    };
    double squares = 0, along = 0, speeds = 0;
    int n = 0;
    for (int i = 0; i < 60 * rate_Hz; ++i) {
        const double t = i / rate_Hz;
        estimator.update(t, noise(truth(t)));
        if (t < 3) continue;
        const PoseEstimate estimate = estimator.predict(t).value();
        const Vector3d error = estimate.rotation * target + estimate.translation - place(t);
        const Vector3d speed = (place(t + 1e-4) - place(t - 1e-4)) / 2e-4;
        squares += error.squaredNorm();
        along -= error.dot(speed);
        speeds += speed.squaredNorm();
        ++n;
    }
    return {std::sqrt(squares / n), along / speeds};
}

TEST(PoseEstimator, CalmsBreathingAndHandlingWithLittleLag) {
    const auto breathing = [](double t) {
        return posed({0, 0.0075 * std::sin(2 * M_PI * 0.25 * t), 0}, 0.03 * std::sin(1.6 * t));
    };
    const auto handling = [](double t) { return pose_of(true_tracker_from_image({}, t)); };
    // raw: 1.52 mm
    EXPECT_LT(follow(15, breathing).rms, 1.1e-3);
    EXPECT_LT(follow(80, breathing).rms, 0.65e-3);
    EXPECT_LT(follow(15, handling).rms, 1.3e-3);
    EXPECT_LT(follow(80, handling).rms, 0.85e-3);
    for (const double rate : {15.0, 40.0, 80.0}) {
        EXPECT_LT(std::abs(follow(rate, breathing).lag_s), 0.016) << rate;
        EXPECT_LT(std::abs(follow(rate, handling).lag_s), 0.005) << rate;
    }
}

TEST(PoseEstimator, HoldsASingleOutlier) {
    for (const TrackedPose& jump : {posed({0.05, 0, 0}), posed(Vector3d::Zero(), 1)}) {
        PoseEstimator estimator = rested();
        EXPECT_EQ(estimator.update(0.025, jump), PoseVerdict::held);
        EXPECT_LT(estimator.predict(0.025)->translation.norm(), 1e-9);
        EXPECT_LT(turn_error(*estimator.predict(0.025), posed(Vector3d::Zero())).norm(), 1e-9);
        EXPECT_EQ(estimator.update(0.05, posed(Vector3d::Zero())), PoseVerdict::accepted);
        EXPECT_EQ(estimator.update(0.075, posed({0.005, 0, 0}, 0.05)), PoseVerdict::accepted);
        for (int i = 4; i <= 6; ++i)
            EXPECT_EQ(estimator.update(i / 40.0, posed({0.2, 0, 0})), PoseVerdict::held)
                << "counts anew";
    }
}

// A chi-square variable with 6 degrees of freedom exceeds 38.258 with probability 1e-6.
TEST(PoseEstimator, GatesByItsOwnCovariance) {
    const PoseEstimatorOptions options = plain_kalman(1e-3, 6e-2);
    for (const double t : {0.025, 0.1, 0.3}) {
        const auto covariance = rested(options).predict(t)->covariance;
        const double variance = covariance(0, 0) + std::pow(options.position_rms, 2) / 3;
        const double turn_variance = covariance(3, 3) + std::pow(options.rotation_rms, 2) / 3;
        for (const double part : {0.0, 0.5, 1.0})  // of the distance in the rotation
            for (const double distance : {38.2, 38.3}) {
                const double x = std::sqrt((1 - part) * distance * variance);
                const double turn = std::sqrt(part * distance * turn_variance);
                PoseEstimator estimator = rested(options);
                EXPECT_EQ(estimator.update(t, posed({0, x, 0}, turn)),
                          distance < 38.258 ? PoseVerdict::accepted : PoseVerdict::held)
                    << t << " s, " << part << ", " << distance;
            }
    }
}

TEST(PoseEstimator, AcceptsAJumpThatStays) {
    PoseEstimator estimator = rested();
    for (int i = 1; i <= 3; ++i)
        EXPECT_EQ(estimator.update(i / 40.0, posed({0.2, 0, 0})), PoseVerdict::held);
    EXPECT_EQ(estimator.update(0.1, posed({0.2, 0, 0})), PoseVerdict::started);
    EXPECT_NEAR(estimator.predict(0.1)->translation.x(), 0.2, 1e-12);
    PoseEstimator slow = rested();
    EXPECT_EQ(slow.update(0.05, posed({2, 0, 0})), PoseVerdict::held);
    EXPECT_EQ(slow.update(0.31, posed({2, 0, 0})), PoseVerdict::started) << "after 0.3 s";
}

TEST(PoseEstimator, TakesARepeatedOrOlderTimeForNoNewSample) {
    PoseEstimator estimator = rested();
    const PoseEstimate before = estimator.predict(0).value();
    for (const double t : {0.0, -0.1, -0.4}) {
        EXPECT_EQ(estimator.update(t, posed({0.01, 0, 0})), PoseVerdict::repeated);
        const PoseEstimate after = estimator.predict(t).value();
        EXPECT_EQ(after.time_s, 0);
        EXPECT_EQ(after.translation, before.translation);
        EXPECT_EQ(after.covariance, before.covariance);
    }
    EXPECT_FALSE(estimator.predict(0.6)) << "frozen";
    EXPECT_EQ(estimator.update(-5, posed({1, 0, 0})), PoseVerdict::started) << "the clock was set";
    EXPECT_NEAR(estimator.predict(-5)->translation.x(), 1, 1e-12);
}

TEST(PoseEstimator, IsLessSureTheLongerThePosesAreMissing) {
    PoseEstimator estimator = rested();
    Eigen::Matrix<double, 6, 6> last = estimator.predict(0)->covariance;
    for (int i = 1; i <= 10; ++i) {
        EXPECT_EQ(estimator.update(i / 25.0, TrackedPose{}), PoseVerdict::unusable);
        const auto now = estimator.predict(i / 25.0)->covariance;
        EXPECT_GT((now - last).eval().eigenvalues().real().minCoeff(), 0);
        last = now;
    }
    EXPECT_GT(last(0, 0), 10 * estimator.predict(0)->covariance(0, 0));
    EXPECT_GT(last(5, 5), 10 * estimator.predict(0)->covariance(5, 5));
    EXPECT_EQ(estimator.update(0.45, posed({0.001, 0, 0})), PoseVerdict::accepted);
    EXPECT_LT(estimator.predict(0.45)->covariance(0, 0), last(0, 0));
    EXPECT_EQ(estimator.update(0.96, posed({0.3, 0, 0})), PoseVerdict::started) << "a long gap";
}

TEST(PoseEstimator, FindsATrackerNoisierThanStated) {
    double variance[2], turn_variance[2];
    for (const int noisy : {0, 1}) {
        PoseEstimator estimator;
        const double ratio = noisy ? 3 : 1;
        TrackerNoise noise(ratio * 1.4e-3, ratio * 0.5 * radians_per_degree, 11);
        double held = 0;
        for (int i = 0; i < 800; ++i)
            held += estimator.update(i / 40.0, noise(posed({0.1, 0, 0}, 2))) == PoseVerdict::held;
        EXPECT_NEAR(estimator.position_noise_ratio() / ratio, 1, 0.2);
        EXPECT_NEAR(estimator.rotation_noise_ratio() / ratio, 1, 0.2);
        EXPECT_LT(held, 8);
        const auto covariance = estimator.predict(20)->covariance;
        variance[noisy] = covariance.topLeftCorner<3, 3>().trace();
        turn_variance[noisy] = covariance.bottomRightCorner<3, 3>().trace();
    }
    EXPECT_GT(variance[1], 3 * variance[0]);
    EXPECT_GT(turn_variance[1], 3 * turn_variance[0]);
}

TEST(PoseEstimator, FollowsManyTurns) {
    PoseEstimator estimator;
    TrackerNoise noise(1.4e-3, 0.5 * radians_per_degree, 3);
    double squares = 0;
    for (int i = 0; i <= 1200; ++i) {  // 30 s at 3 rad/s: 14 turns
        const double t = i / 40.0;
        const TrackedPose truth = posed(Vector3d::Zero(), 3 * t);
        EXPECT_LE(estimator.update(t, noise(truth)), PoseVerdict::started) << t;
        if (t > 2) squares += turn_error(*estimator.predict(t), truth).squaredNorm() / 1120;
    }
    EXPECT_LT(std::sqrt(squares), 0.7 * 0.5 * radians_per_degree);
    EXPECT_LT((estimator.predict(30)->rotation * estimator.predict(30)->rotation.transpose() -
               Matrix3d::Identity())
                  .norm(),
              1e-12);
}

TEST(PoseEstimator, DoesNotDependOnTheAxesNorOnTheClock) {
    const Matrix3d turn = AngleAxisd(1, Vector3d(3, 2, 1).normalized()).toRotationMatrix();
    PoseEstimator estimator, turned;
    for (int i = 0; i < 200; ++i) {
        const double t = i / 64.0;  // exact, as is the sum with 1e9
        const TrackedPose raw = posed({std::sin(t), std::cos(2 * t), 0.1 * t}, 2 * std::sin(t));
        estimator.update(t, raw);
        turned.update(1e9 + t, {turn * raw.rotation, turn * raw.translation, PoseStatus::ok});
        const PoseEstimate a = estimator.predict(t + 0.125).value();
        const PoseEstimate b = turned.predict(1e9 + t + 0.125).value();
        EXPECT_LT((turn * a.translation - b.translation).norm(), 1e-10);
        EXPECT_LT((turn * a.rotation - b.rotation).norm(), 1e-10);
        EXPECT_LT((turn * a.covariance.topLeftCorner<3, 3>() * turn.transpose() -
                   b.covariance.topLeftCorner<3, 3>())
                      .norm(),
                  1e-10);
    }
}

TEST(PoseEstimator, SurvivesAnyTimesAndPoses) {
    const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
    PoseEstimator estimator;
    EXPECT_FALSE(estimator.predict(0));
    int i = 0;
    for (const double t : {0.0, 0.0, 1e-300, 1e-9, 0.1, 0.05, 0.1 + 1e-16, 0.3, nan, infinite, 0.31,
                           1e300, 1.0, 1.02, -1e300, 1e9, 1e9 + 1e-7}) {
        const PoseVerdict verdict = estimator.update(t, posed({0.01 * i, 0, 0}, 3.14159 * i));
        EXPECT_EQ(verdict == PoseVerdict::unusable, !std::isfinite(t));
        if (const auto estimate = estimator.predict(t)) {
            EXPECT_TRUE(estimate->translation.allFinite() && estimate->rotation.allFinite()) << t;
            EXPECT_GT(estimate->covariance.eigenvalues().real().minCoeff(), 0) << t;
        }
        ++i;
    }
    EXPECT_FALSE(estimator.predict(nan));
    EXPECT_EQ(estimator.update(1e9 + 0.1, posed({nan, 0, 0})), PoseVerdict::unusable);
    EXPECT_EQ(estimator.update(1e9 + 0.1, TrackedPose{}), PoseVerdict::unusable);
    estimator.reset();
    EXPECT_FALSE(estimator.predict(1e9));
}

TEST(PoseEstimator, RefusesBadOptions) {
    const auto refused = [](const std::function<void(PoseEstimatorOptions&)>& change) {
        PoseEstimatorOptions options;
        change(options);
        EXPECT_THROW(PoseEstimator{options}, Error);
    };
    const double nan = std::nan("");
    for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
        refused([&](auto& o) { o.position_rms = bad; });
        refused([&](auto& o) { o.rotation_rms = bad; });
        refused([&](auto& o) { o.acceleration_densities[1] = bad; });
        refused([&](auto& o) { o.turn_acceleration_densities[2] = bad; });
        refused([&](auto& o) { o.model_shares[0] = bad; });
        refused([&](auto& o) { o.change_rate = bad; });
        refused([&](auto& o) { o.start_speed = bad; });
        refused([&](auto& o) { o.start_turn_rate = bad; });
        refused([&](auto& o) { o.gate_probability = bad; });
        refused([&](auto& o) { o.max_held_s = bad; });
        refused([&](auto& o) { o.max_gap_s = bad; });
    }
    refused([](auto& o) { o.acceleration_densities = {1e-3, 1e-6, 1e-2, 1}; });
    refused([](auto& o) { o.model_shares = {0.5, 0.2, 0.2, 0.2}; });
    refused([](auto& o) { o.max_held = -1; });
    try {
        PoseEstimatorOptions options;
        options.position_rms = -1;
        PoseEstimator{options};
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(), "pose estimator: position_rms = -1 must be finite and > 0");
    }
}

}  // namespace
}  // namespace livetet
