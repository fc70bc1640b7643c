#pragma once

#include <array>
#include <cstddef>

namespace livetet {

/// Running estimate of a latency from those of single frames, some of which are late. With the
/// median m of the last 31 latencies, each new one moves the estimate L by
///
///     L' = L + 0.05 (m - L),     L = 0 before the first one.
///
/// Single late frames do not change it, and it does not jump. Allocates nothing.
class LatencyEstimate {
  public:
    /// Notes the latency of a frame, s. One above `max_s` counts as `max_s`; one that is negative
    /// or not finite is ignored.
    void add(double latency_s);
    /// The estimate, s; from 0 to `max_s`.
    double seconds() const { return estimate_s_; }

    static constexpr double max_s = 0.1;

  private:
    double median() const;

    std::array<double, 31> recent_s_{};  // a ring
    std::size_t next_ = 0, count_ = 0;
    double estimate_s_ = 0;
};

}  // namespace livetet
