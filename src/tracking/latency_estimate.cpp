#include "tracking/latency_estimate.hpp"

#include <algorithm>
#include <cmath>

namespace livetet {

namespace {

constexpr double share_of_new = 0.05;

}  // namespace

void LatencyEstimate::add(double latency_s) {
    if (!(latency_s >= 0) || !std::isfinite(latency_s)) return;
    recent_s_[next_] = std::min(latency_s, max_s);
    next_ = (next_ + 1) % recent_s_.size();
    count_ = std::min(count_ + 1, recent_s_.size());
    estimate_s_ += share_of_new * (median() - estimate_s_);
}

/// Of an even number the smaller of the two in the middle: the first frame of a run is often late.
double LatencyEstimate::median() const {
    std::array<double, 31> sorted = recent_s_;
    const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(count_);
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((count_ - 1) / 2);
    std::nth_element(sorted.begin(), middle, end);
    return *middle;
}

}  // namespace livetet
