#include "tracking/lag_meter.hpp"

#include <algorithm>
#include <cmath>

namespace livetet {

void LagMeter::use(double time_s, const Eigen::Vector3d& position) {
    const std::size_t size = used_.size();
    if (count_ > 0 && !(time_s > used_[(next_ + size - 1) % size].time_s)) {
        // The clock was set back, or the same sample came again.
        if (time_s > used_[(next_ + size - 1) % size].time_s - 1) return;
        count_ = 0;
        compared_s_.reset();
    }
    used_[next_] = {time_s, position};
    next_ = (next_ + 1) % size;
    count_ = std::min(count_ + 1, size);
}

void LagMeter::compare(const PoseEstimate& smoothed) {
    if (compared_s_ && smoothed.time_s <= *compared_s_) return;
    const std::size_t size = used_.size();
    for (std::size_t k = 1; k <= count_; ++k) {
        const Used& used = used_[(next_ + size - k) % size];
        if (used.time_s > smoothed.time_s) continue;
        if (used.time_s < smoothed.time_s) return;  // nothing was in use then
        const double passed_s = compared_s_ ? smoothed.time_s - *compared_s_ : 0;
        compared_s_ = smoothed.time_s;
        const Eigen::Vector3d& v = smoothed.velocity;
        if (v.norm() < min_speed) return;
        const double fade = std::exp(-passed_s / memory_s);
        products_ = fade * products_ - v.dot(used.position - smoothed.translation);
        squares_ = fade * squares_ + v.squaredNorm();
        return;
    }
}

std::optional<double> LagMeter::lag_s() const {
    if (squares_ < min_squares) return {};
    return products_ / squares_;
}

}  // namespace livetet
