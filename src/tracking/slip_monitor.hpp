#pragma once

#include <Eigen/Core>

#include <optional>

namespace livetet {

/// Limits of a SlipMonitor.
struct SlipLimits {
    /// Excess along the surface that is no slip, m: about twice what a sensor that rides along
    /// has beside a deep press, as the model deforms otherwise than the organ does.
    double min_excess = 0.004;
    /// The same as a multiple of the deviation of the sensor's motion by noise, of which the mean
    /// takes a part away. Both limits are independent, and added as such.
    double deviations = 2;
    /// Excess along the surface over that into the organ, below which it is a press: nearly twice
    /// that of a press at 30 degrees from the normal.
    double cone = 1;
    /// For so long, and in so many frames, the excess must be beyond the limits.
    double duration_s = 0.25;
    int min_frames = 4;
    double averaging_s = 0.1;  ///< time constant of the mean of the excess
    double max_gap_s = 0.5;    ///< without an excess for longer, it starts afresh
};

/// Tells a sensor that slips over the organ from one that presses it or rides on it. The excess
///
///     e = displacement of the sensor - that of the tissue under its patch, were the patch free,
///
/// both since the sensor was placed, is small if it rides along, points into the organ if it
/// presses, and along the surface if it slips. Let e be the mean of the last excesses, n the
/// outward normal, e_n = max(0, -e . n), e_t the length of e - (e . n) n, and s the deviation of
/// the sensor's motion by noise. It slips where for
/// `duration_s` and `min_frames`
///
///     e_t > hypot(min_excess, deviations s)     and     e_t > cone e_n.
///
/// Times are those of the samples. Allocates nothing.
class SlipMonitor {
  public:
    explicit SlipMonitor(const SlipLimits& limits = {}) : limits_(limits) {}

    /// Adds the excess (m) of a frame in which the sensor is followed. `outwards`: a unit vector;
    /// `deviation`: of the sensor's motion by noise, along an axis, m. An excess that is not finite
    /// is left out. Returns whether the sensor slips.
    bool update(double time_s, const Eigen::Vector3d& excess, const Eigen::Vector3d& outwards,
                double deviation);
    /// Forgets all excesses.
    void restart() { *this = SlipMonitor(limits_); }

  private:
    bool is_beyond(const Eigen::Vector3d& outwards, double deviation) const;

    SlipLimits limits_;
    Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();
    std::optional<double> last_s_, since_s_;  ///< last excess; first one beyond the limits
    int beyond_ = 0;                          ///< frames since then
};

}  // namespace livetet
