#pragma once

#include <array>

#include "geometry/transform.hpp"

namespace livetet {

/// Options of a RestAverage.
struct RestAverageOptions {
    double window_s = 0.5;  ///< averaging time
    /// A pose farther than this from the running mean restarts the averaging, m. Set it to several
    /// times the tracker's noise.
    double max_scatter = 0.01;
    /// The sensor rests if the mean of no quarter of the window is farther than this from the
    /// mean of all, m. Three standard errors of a quarter's mean are allowed if they are more.
    double max_drift = 0.002;
};

/// Averages the poses of a sensor over a window of time in which it rests. A sensor that moves has
/// its oldest quarter of the window forgotten, and is averaged on.
class RestAverage {
  public:
    explicit RestAverage(const RestAverageOptions& options) : options_(options) {}

    /// Whether the mean is complete, and if not, whether the sensor was seen to move.
    enum class State { averaging, moving, complete };

    /// Adds a pose. Times must not decrease.
    State add(double time_s, const RigidTransform<ImageFrame, Sensor>& image_from_sensor);
    /// Number of poses in the mean.
    int poses() const { return whole().poses; }
    /// The mean pose. Needs at least one pose.
    RigidTransform<ImageFrame, Sensor> mean() const;
    /// Forgets all poses.
    void restart();
    State state() const { return state_; }

  private:
    /// Sums over a quarter of the window.
    struct Quarter {
        int poses = 0;
        Eigen::Matrix3d rotations = Eigen::Matrix3d::Zero();
        Eigen::Vector3d places = Eigen::Vector3d::Zero();  ///< from origin_, m
        double squares = 0;                                ///< of those, m^2

        Quarter& operator+=(const Quarter& other);
        Eigen::Vector3d mean() const { return places / poses; }
        /// Sum of the squared distances from the mean.
        double scatter() const { return squares - places.squaredNorm() / poses; }
    };
    Quarter whole() const;
    bool rests() const;
    void forget_oldest();

    RestAverageOptions options_;
    std::array<Quarter, 4> quarters_{};
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  ///< the first pose; keeps the sums small
    double first_s_ = 0;
    State state_ = State::averaging;
};

}  // namespace livetet
