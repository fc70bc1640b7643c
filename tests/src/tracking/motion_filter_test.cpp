#include "tracking/motion_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using Eigen::Vector3d;

/// All models alike: a plain Kalman filter.
MotionFilterOptions kalman_options(double noise_rms, double density) {
    return {noise_rms, {density, density, density, density}, {0.2, 0.4, 0.3, 0.1}, 1, 0.1};
}

// In the steady state the gains are alpha for x and beta / T for v. With Q of white-noise
// acceleration of density q, the Riccati equation gives
//     lambda^2 = q T^3 / r = beta^2 / (1 - alpha),   alpha^2 = beta (2 - alpha) - beta^2 / 6
// (Kalata 1984 for piecewise constant acceleration, whose last term is beta^2 / 4).
TEST(MotionFilter, HasTheSteadyStateOfTheAlphaBetaFilter) {
    const double T = 0.025, r = 1e-6;
    for (const double alpha : {0.1, 0.3, 0.6, 0.9}) {
        const double b = 2 - alpha;
        const double beta = 3 * (b - std::sqrt(b * b - 2 * alpha * alpha / 3));
        const double q = beta * beta / (1 - alpha) * r / (T * T * T);
        MotionFilter filter(kalman_options(std::sqrt(3 * r), q));
        filter.start(Vector3d::Zero());
        for (int i = 0; i < 500; ++i) {
            filter.advance(T);
            filter.correct(Vector3d::Zero());
        }
        const Eigen::Matrix2d P = filter.now().merged().covariance;
        EXPECT_NEAR(P(0, 0) / (alpha * r), 1, 1e-9) << alpha;
        EXPECT_NEAR(P(0, 1) / (beta * r / T), 1, 1e-9) << alpha;
        filter.advance(T);
        filter.correct({1, 2, 3});
        const auto mean = filter.now().merged().mean;
        EXPECT_LT((mean.row(0).transpose() - alpha * Vector3d(1, 2, 3)).norm(), 1e-9) << alpha;
        EXPECT_LT((mean.row(1).transpose() - beta / T * Vector3d(1, 2, 3)).norm(), 1e-7) << alpha;
    }
}

TEST(MotionMixture, AddsTheSpreadOfItsModels) {
    MotionMixture mixture;
    mixture.probability = {0.25, 0.75, 0, 0};
    for (MotionGaussian& m : mixture.models) m.covariance << 1, 0.5, 0.5, 2;
    mixture.models[0].mean << 4, 0, 0, 0, 2, 0;
    const MotionGaussian merged = mixture.merged();
    EXPECT_EQ(merged.mean(0, 0), 1);
    EXPECT_EQ(merged.mean(1, 1), 0.5);
    // variances 0.25 * 0.75 * 4^2 along x and 0.25 * 0.75 * 2^2 along the velocity's y
    EXPECT_NEAR(merged.covariance(0, 0), 1 + 3 / 3.0, 1e-12);
    EXPECT_NEAR(merged.covariance(1, 1), 2 + 0.75 / 3, 1e-12);
    EXPECT_NEAR(merged.covariance(0, 1), 0.5, 1e-12);
    EXPECT_LT(
        (mixture.position_covariance() - Eigen::Matrix3d(Vector3d(4, 1, 1).asDiagonal())).norm(),
        1e-12);
}

TEST(MotionFilter, WeighsTheModelsByWhatMoves) {
    MotionFilter filter({1e-3, {1e-6, 1e-4, 1e-2, 1}, {0.2, 0.4, 0.3, 0.1}, 1, 0.05});
    TrackerNoise noise(1e-3, 0, 1);
    // ten seconds each: rest, accelerations of 0.04 and 0.3 m/s^2 at most, and of 14
    const auto place = [](double t) {
        if (t <= 10) return 0.0;
        if (t <= 20) return 0.03 * (1 - std::cos(1.2 * (t - 10)));
        if (t <= 30) return 0.03 * (1 - std::cos(3 * (t - 20)));
        return 0.1 * std::sin(12 * t);
    };
    PerMotionModel mean{};  // of the probability of the model that fits, without two seconds each
    filter.start(Vector3d::Zero());
    for (int i = 1; i < 1600; ++i) {
        const double t = i / 40.0;
        filter.advance(1 / 40.0);
        filter.correct(
            noise({Eigen::Matrix3d::Identity(), {place(t), 0, 0}, PoseStatus::ok}).translation);
        const PerMotionModel& probability = filter.now().probability;
        const int fits = i / 400;
        if (i % 400 >= 80) mean[fits] += probability[fits] / 320;
        EXPECT_NEAR(std::accumulate(probability.begin(), probability.end(), 0.0), 1, 1e-12);
    }
    EXPECT_GT(mean[0], 0.8);
    EXPECT_GT(mean[1], 0.5);
    EXPECT_GT(mean[2], 0.5);
    EXPECT_GT(mean[3], 0.8);
}

TEST(MotionFilter, ForgetsTheModelInTimeByTheRateOfChange) {
    const MotionFilterOptions options{1e-3, {1e-6, 1e-4, 1e-2, 1}, {0.2, 0.4, 0.3, 0.1}, 2, 0.05};
    MotionFilter filter(options);
    filter.start(Vector3d::Zero());
    for (int i = 0; i < 400; ++i) {
        filter.advance(1 / 40.0);
        filter.correct(Vector3d::Zero());
    }
    const double before = filter.now().probability[0];
    ASSERT_GT(before, 0.9);
    MotionFilter halves = filter;
    filter.advance(0.4);
    EXPECT_NEAR(filter.now().probability[0], 0.2 + (before - 0.2) * std::exp(-0.8), 1e-12);
    halves.advance(0.1);
    halves.advance(0.3);
    for (int j = 0; j < motion_models; ++j)
        EXPECT_NEAR(halves.now().probability[j], filter.now().probability[j], 1e-12);
}

TEST(MotionFilter, LearnsTheNoiseAtIrregularTimesAndWhileItMoves) {
    for (const double ratio : {1.0, 3.0, 6.0})
        for (const double speed : {0.0, 0.4}) {  // m/s: 1.2 rad/s at 0.35 m
            MotionFilter filter({1e-3, {1e-6, 1e-4, 1e-2, 1}, {0.2, 0.4, 0.3, 0.1}, 1, 0.05});
            TrackerNoise noise(ratio * 1e-3, 0, 7);
            double t = 0, sum = 0;
            int n = 0;
            filter.start(Vector3d::Zero());
            for (int i = 0; i < 3000; ++i) {
                const double dt = (i % 3 + 1) / 100.0;
                t += dt;
                const double x = 0.35 * std::sin(speed / 0.35 * t);
                const Vector3d z =
                    noise({Eigen::Matrix3d::Identity(), {x, 0, 0}, PoseStatus::ok}).translation;
                filter.advance(dt);
                filter.learn_noise(z);
                filter.correct(z);
                if (i > 500) sum += filter.noise_ratio(), ++n;
            }
            EXPECT_NEAR(sum / n / ratio, 1.02, 0.06) << ratio << " at " << speed << " m/s";
        }
}

}  // namespace
}  // namespace livetet
