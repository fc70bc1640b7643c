#pragma once

#include <Eigen/Core>

#include <array>

namespace livetet {

/// How a tracked body moves: the models of a MotionFilter.
enum class MotionModel { quiet, slow, quick, sudden };

constexpr int motion_models = 4;

/// A number for each MotionModel.
using PerMotionModel = std::array<double, motion_models>;

/// Gaussian of a vector in space: rows of the mean are the vector x and its velocity v; each axis
/// has the covariance of (x, v).
struct MotionGaussian {
    Eigen::Matrix<double, 2, 3> mean = Eigen::Matrix<double, 2, 3>::Zero();
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// A Gaussian for each MotionModel and the models' probabilities.
struct MotionMixture {
    std::array<MotionGaussian, motion_models> models;
    PerMotionModel probability{};

    /// Mean and covariance; the spread of the models is averaged over the axes.
    MotionGaussian merged() const;
    /// Covariance of x, with the spread of the models along each axis.
    Eigen::Matrix3d position_covariance() const;
};

/// Options of a MotionFilter; L is the unit of the followed vector (m, or rad).
struct MotionFilterOptions {
    double noise_rms = 0;        ///< RMS length of a measurement's error, L
    PerMotionModel densities{};  ///< of the white-noise acceleration per axis, L^2/s^3
    PerMotionModel shares{};     ///< probabilities of the models when nothing is known; sum 1
    double change_rate = 0;      ///< rate at which the model is drawn anew by `shares`, 1/s
    double start_speed = 0;      ///< standard deviation per axis of the speed at the start, L/s
};

/// Interacting-multiple-model filter of a vector in space: Kalman filters with nearly constant
/// velocity, one for each MotionModel. Their state (x, v) and measurement z obey
///
///     x' = v,   v' = white noise of spectral density q,   z = x + noise of variance r per axis
///
/// The noise is isotropic, so the three axes of a model share one 2 x 2 covariance. Each model
/// starts a time step from the mixture of all, weighed by the probability of a change; the
/// likelihood of the measurement weighs the models.
///
/// r is the stated variance times a factor >= 1, which is learned from the innovations of the
/// parabola through the last three measurements: the factor at which their median is that of noise.
/// Neither q nor a motion that is quicker than the models for less than half of the time shifts it.
/// Noise whose errors last for several measurements is underestimated.
///
/// Order of use: `start`, then for each measurement `advance`, `learn_noise` and, unless it is an
/// outlier, `correct`.
/// Source: Blom and Bar-Shalom (1988), "The interacting multiple model algorithm for systems with
/// Markovian switching coefficients", IEEE TAC 33(8).
class MotionFilter {
  public:
    explicit MotionFilter(const MotionFilterOptions& options) : options_(options) {}

    /// Starts at a measurement, at unknown speed. The noise factor is kept.
    void start(const Eigen::Vector3d& measured);
    /// Time update by dt >= 0 seconds.
    void advance(double dt);
    /// Squared Mahalanobis distance of a measurement from the prediction of the nearest model:
    /// chi-square with 3 degrees of freedom if that model is right.
    double squared_distance(const Eigen::Vector3d& measured) const;
    void learn_noise(const Eigen::Vector3d& measured);
    /// Measurement update.
    void correct(const Eigen::Vector3d& measured);
    /// Sets the stated RMS length of the next measurements' error; the learned factor is kept.
    void set_noise(double noise_rms) { options_.noise_rms = noise_rms; }
    /// Moves the origin of x by `by`.
    void move_origin(const Eigen::Vector3d& by);

    const MotionMixture& now() const { return now_; }
    /// The models as they were before the last time update, each mixed by the probability of the
    /// change to it; for a smoother.
    const std::array<MotionGaussian, motion_models>& before() const { return before_; }
    const MotionFilterOptions& options() const { return options_; }
    /// RMS length of the measurement error as learned, relative to the stated one; >= 1.
    double noise_ratio() const;

  private:
    double noise() const;
    void remember(const Eigen::Vector3d& measured);

    MotionFilterOptions options_;
    MotionMixture now_;
    std::array<MotionGaussian, motion_models> before_;
    double noise_factor_ = 1;  // of the variance
    // the last measurements and their ages, the newest first
    std::array<Eigen::Vector3d, 3> measured_{};
    std::array<double, 3> age_s_{};
    int measurements_ = 0;
};

/// Transition of (x, v) over dt seconds, and its noise for spectral density 1.
Eigen::Matrix2d motion_transition(double dt);
Eigen::Matrix2d motion_noise(double dt);

}  // namespace livetet
