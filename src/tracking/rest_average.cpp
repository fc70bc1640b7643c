#include "tracking/rest_average.hpp"

#include <algorithm>
#include <cmath>

namespace livetet {

RestAverage::Quarter& RestAverage::Quarter::operator+=(const Quarter& other) {
    poses += other.poses;
    rotations += other.rotations;
    places += other.places;
    squares += other.squares;
    return *this;
}

RestAverage::Quarter RestAverage::whole() const {
    Quarter sum;
    for (const Quarter& q : quarters_) sum += q;
    return sum;
}

RestAverage::State RestAverage::add(double time_s,
                                    const RigidTransform<ImageFrame, Sensor>& image_from_sensor) {
    const Quarter before = whole();
    if (before.poses > 0 &&
        (image_from_sensor.translation - origin_ - before.mean()).norm() > options_.max_scatter) {
        quarters_ = {};
        state_ = State::moving;
    }
    if (whole().poses == 0) {
        origin_ = image_from_sensor.translation;
        first_s_ = time_s;
    }
    const double quarter_s = options_.window_s / 4;
    const auto k = time_s - first_s_ < 3 * quarter_s
                       ? static_cast<std::size_t>((time_s - first_s_) / quarter_s)
                       : std::size_t{3};
    const Eigen::Vector3d place = image_from_sensor.translation - origin_;
    quarters_[k] += {1, image_from_sensor.rotation, place, place.squaredNorm()};
    if (time_s - first_s_ < options_.window_s) return state_;
    if (rests()) return state_ = State::complete;
    forget_oldest();
    return state_ = State::moving;
}

bool RestAverage::rests() const {
    const Quarter all = whole();
    double scatter = 0, drift = 0;
    int filled = 0, fewest = all.poses;
    for (const Quarter& q : quarters_) {
        if (q.poses == 0) continue;
        ++filled;
        fewest = std::min(fewest, q.poses);
        scatter += q.scatter();
        drift = std::max(drift, (q.mean() - all.mean()).norm());
    }
    // The noise of a pose, pooled within the quarters, as the sensor hardly moves in one of them.
    const double variance = all.poses > filled ? std::max(0.0, scatter) / (all.poses - filled) : 0;
    return drift <= std::max(options_.max_drift, 3 * std::sqrt(variance / fewest));
}

void RestAverage::forget_oldest() {
    std::rotate(quarters_.begin(), quarters_.begin() + 1, quarters_.end());
    quarters_.back() = {};
    first_s_ += options_.window_s / 4;
}

RigidTransform<ImageFrame, Sensor> RestAverage::mean() const {
    const Quarter all = whole();
    return {nearest_rotation(all.rotations), origin_ + all.mean()};
}

void RestAverage::restart() {
    quarters_ = {};
    state_ = State::averaging;
}

}  // namespace livetet
