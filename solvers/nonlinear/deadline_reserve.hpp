#pragma once

#include <algorithm>

#include "base/deadline.hpp"

namespace livetet {

/// How long before its deadline a frame ends its linear solves, so that all but few frames keep the
/// deadline on a machine whose other programs take the core now and then. No iteration can know
/// that it will be interrupted: time is left for it.
///
/// The time left is a running estimate of the quantile `kept` of what frames lose: a late frame
/// raises it by kept * step, one in time lowers it by (1 - kept) * step, so that it is at rest
/// where one frame in 1 / (1 - kept) is late (H. Robbins and S. Monro, A stochastic approximation
/// method, 1951). Where frames are never late it is zero.
class DeadlineReserve {
  public:
    static constexpr double kept = 0.995;

    /// When to stop for that deadline: at most half of the time that is left is given up.
    Deadline before(const Deadline& deadline) {
        const double left_s = std::max(deadline.left_s(), 0.0);
        step_s_ = step * left_s;
        return deadline.earlier_by(std::min(seconds_, left_s / 2));
    }
    /// After the frame that `before` was asked for.
    void learn(bool late) {
        seconds_ = std::max(0.0, seconds_ + (late ? kept : kept - 1) * step_s_);
    }
    double seconds() const { return seconds_; }

  private:
    static constexpr double step = 0.2;  ///< of the time that a frame has

    double seconds_ = 0, step_s_ = 0;
};

}  // namespace livetet
