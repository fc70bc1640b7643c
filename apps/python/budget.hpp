#pragma once

#include <cmath>
#include <optional>

#include "base/deadline.hpp"
#include "base/error.hpp"

namespace livetet::python {

/// The deadline of a frame that began at `start` and may take `budget_ms`; none: no limit. Throws
/// Error unless the budget is from 0 to an hour.
inline std::optional<Deadline> deadline_of(Clock::time_point start,
                                           std::optional<double> budget_ms) {
    constexpr double max_ms = 3.6e6;
    if (!budget_ms) return std::nullopt;
    if (!(*budget_ms >= 0 && *budget_ms <= max_ms))
        fail("budget_ms: found {}, expected 0 to {:.0f}, or None for no limit", *budget_ms, max_ms);
    return Deadline::after(start, *budget_ms / 1e3);
}

}  // namespace livetet::python
