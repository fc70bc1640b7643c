#include "tracking/motion_filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace livetet {

namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::RowVector3d;
using Eigen::Vector3d;

/// Change of the logarithm of the noise's variance by one measurement.
constexpr double noise_step = 0.03;
constexpr double max_noise_factor = 1e4;
/// Median of a chi-square variable with 3 degrees of freedom.
constexpr double chi_square_3_median = 2.36597;
/// Keeps the logarithms of probabilities finite.
constexpr double min_probability = 1e-12;

}  // namespace

Matrix2d motion_transition(double dt) { return Matrix2d{{1, dt}, {0, 1}}; }

Matrix2d motion_noise(double dt) {
    return Matrix2d{{dt * dt * dt / 3, dt * dt / 2}, {dt * dt / 2, dt}};
}

MotionGaussian MotionMixture::merged() const {
    MotionGaussian merged;
    for (int j = 0; j < motion_models; ++j) merged.mean += probability[j] * models[j].mean;
    for (int j = 0; j < motion_models; ++j) {
        const Eigen::Matrix<double, 2, 3> apart = models[j].mean - merged.mean;
        merged.covariance +=
            probability[j] * (models[j].covariance + apart * apart.transpose() / 3);
    }
    return merged;
}

Matrix3d MotionMixture::position_covariance() const {
    const RowVector3d mean = merged().mean.row(0);
    Matrix3d covariance = Matrix3d::Zero();
    for (int j = 0; j < motion_models; ++j) {
        const RowVector3d apart = models[j].mean.row(0) - mean;
        covariance += probability[j] * (models[j].covariance(0, 0) * Matrix3d::Identity() +
                                        apart.transpose() * apart);
    }
    return covariance;
}

double MotionFilter::noise() const {
    return noise_factor_ * options_.noise_rms * options_.noise_rms / 3;
}

double MotionFilter::noise_ratio() const { return std::sqrt(noise_factor_); }

void MotionFilter::start(const Vector3d& measured) {
    MotionGaussian state;
    state.mean.row(0) = measured;
    state.covariance.diagonal() << noise(), options_.start_speed * options_.start_speed;
    now_.models.fill(state);
    now_.probability = options_.shares;
    measurements_ = 0;
    remember(measured);
}

void MotionFilter::advance(double dt) {
    const double stay = std::exp(-options_.change_rate * dt);
    const MotionMixture last = now_;
    for (int j = 0; j < motion_models; ++j) {
        const double change = (1 - stay) * options_.shares[j];
        now_.probability[j] = stay * last.probability[j] + change;
        MotionMixture from = last;  // which model held, given that model j holds now
        for (int i = 0; i < motion_models; ++i)
            from.probability[i] *= ((i == j ? stay : 0) + change) / now_.probability[j];
        before_[j] = from.merged();
        const Matrix2d transition = motion_transition(dt);
        now_.models[j].mean = transition * before_[j].mean;
        now_.models[j].covariance = transition * before_[j].covariance * transition.transpose() +
                                    options_.densities[j] * motion_noise(dt);
    }
    for (double& age : age_s_) age += dt;
}

double MotionFilter::squared_distance(const Vector3d& measured) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const MotionGaussian& m : now_.models)
        nearest = std::min(nearest, (measured.transpose() - m.mean.row(0)).squaredNorm() /
                                        (m.covariance(0, 0) + noise()));
    return nearest;
}

void MotionFilter::correct(const Vector3d& measured) {
    Eigen::Array<double, motion_models, 1> log_weight;
    for (int j = 0; j < motion_models; ++j) {
        MotionGaussian& m = now_.models[j];
        const RowVector3d innovation = measured.transpose() - m.mean.row(0);
        const double variance = m.covariance(0, 0) + noise();
        const Eigen::Vector2d gain = m.covariance.col(0) / variance;
        m.mean += gain * innovation;
        m.covariance -= variance * gain * gain.transpose();
        log_weight[j] = std::log(now_.probability[j]) -
                        0.5 * (innovation.squaredNorm() / variance + 3 * std::log(variance));
    }
    const auto weight = (log_weight - log_weight.maxCoeff()).exp().max(min_probability).eval();
    for (int j = 0; j < motion_models; ++j) now_.probability[j] = weight[j] / weight.sum();
}

/// Lagrange's weights extrapolate the parabola through the measurements i of age s_i to now:
///
///     w_i = prod_{j != i} s_j / (s_j - s_i)
///
/// The squared miss over r (1 + sum w_i^2) is chi-square with 3 degrees of freedom. The logarithm
/// of r takes a fixed step towards where half of the misses are above its median.
void MotionFilter::learn_noise(const Vector3d& measured) {
    if (measurements_ == 3) {
        Vector3d miss = measured;
        double squares = 1;
        for (int i = 0; i < 3; ++i) {
            const double s = age_s_[i], t = age_s_[(i + 1) % 3], u = age_s_[(i + 2) % 3];
            const double weight = t * u / ((t - s) * (u - s));
            miss -= weight * measured_[i];
            squares += weight * weight;
        }
        const bool above = miss.squaredNorm() > chi_square_3_median * noise() * squares;
        noise_factor_ = std::clamp(noise_factor_ * std::exp(above ? noise_step : -noise_step), 1.0,
                                   max_noise_factor);
    }
    remember(measured);
}

void MotionFilter::remember(const Vector3d& measured) {
    std::shift_right(measured_.begin(), measured_.end(), 1);
    std::shift_right(age_s_.begin(), age_s_.end(), 1);
    measured_[0] = measured;
    age_s_[0] = 0;
    measurements_ = std::min(measurements_ + 1, 3);
}

void MotionFilter::move_origin(const Vector3d& by) {
    for (MotionGaussian& m : now_.models) m.mean.row(0) -= by.transpose();
    for (Vector3d& z : measured_) z -= by;
}

}  // namespace livetet
