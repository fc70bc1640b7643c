#include "tracking/slip_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace livetet {

using Eigen::Vector3d;

bool SlipMonitor::is_beyond(const Vector3d& outwards, double deviation) const {
    const double along_normal = mean_.dot(outwards);
    const double along_surface = (mean_ - along_normal * outwards).norm();
    return along_surface > std::hypot(limits_.min_excess, limits_.deviations * deviation) &&
           along_surface > limits_.cone * std::max(0.0, -along_normal);
}

bool SlipMonitor::update(double time_s, const Vector3d& excess, const Vector3d& outwards,
                         double deviation) {
    if (!excess.allFinite()) return false;
    if (last_s_ && time_s - *last_s_ > limits_.max_gap_s) restart();
    if (last_s_) {
        const double dt = std::max(0.0, time_s - *last_s_);
        mean_ += (1 - std::exp(-dt / limits_.averaging_s)) * (excess - mean_);
    } else {
        mean_ = excess;
    }
    last_s_ = last_s_ ? std::max(time_s, *last_s_) : time_s;
    if (!is_beyond(outwards, deviation)) {
        since_s_.reset();
        beyond_ = 0;
        return false;
    }
    if (!since_s_) since_s_ = last_s_;
    return ++beyond_ >= limits_.min_frames && *last_s_ - *since_s_ >= limits_.duration_s;
}

}  // namespace livetet
