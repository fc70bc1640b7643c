#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <optional>

#include "tracking/pose_estimator.hpp"

namespace livetet {

/// Measures by how much the poses in use are late, without knowing the truth. The position `used`
/// at a time is compared with the smoothed position x and velocity v of the same time, which are
/// known later and do not lag:
///
///     lag = - sum w v . (used - x) / sum w v . v
///
/// over the moments at which the tool moves; the weights w fall by e in `memory_s` of motion. A
/// pose that was extrapolated too far gives a negative lag. Allocates nothing.
class LagMeter {
  public:
    /// Notes a position in use, m. Times that do not ascend are ignored.
    void use(double time_s, const Eigen::Vector3d& position);
    /// Compares the position used at the estimate's time with it, once for each time.
    void compare(const PoseEstimate& smoothed);

    /// The lag, s, to about 5 ms; empty until the tool has moved enough to tell.
    std::optional<double> lag_s() const;

    static constexpr double memory_s = 30;
    static constexpr double min_speed = 0.01;  ///< m/s; below it the tool counts as resting
    /// Least sum w v . v, m^2/s^2: positions that differ by 0.7 mm of noise then tell 5 ms.
    static constexpr double min_squares = 0.02;

  private:
    struct Used {
        double time_s = 0;
        Eigen::Vector3d position = Eigen::Vector3d::Zero();
    };
    std::array<Used, 128> used_{};  // a ring; the newest is before next_
    std::size_t next_ = 0, count_ = 0;
    std::optional<double> compared_s_;
    double products_ = 0, squares_ = 0;
};

}  // namespace livetet
