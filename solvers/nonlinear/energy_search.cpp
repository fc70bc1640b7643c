#include "solvers/nonlinear/energy_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace livetet {

namespace {

constexpr double c1 = 1e-4, c2 = 0.5;
constexpr double min_growth = 1.2, max_growth = 4;  ///< of the length, from trial to trial

/// Where the cubic through the energies and slopes of two points has its minimum; not finite where
/// it has none.
double cubic_minimum(const LinePoint& a, const LinePoint& b) {
    const double d1 = a.slope + b.slope - 3 * (a.energy - b.energy) / (a.length - b.length);
    const double d2 = std::copysign(std::sqrt(d1 * d1 - a.slope * b.slope), b.length - a.length);
    return b.length - (b.length - a.length) * (b.slope + d2 - d1) / (b.slope - a.slope + 2 * d2);
}

bool is_finite(const LinePoint& p) { return std::isfinite(p.energy) && std::isfinite(p.slope); }

}  // namespace

bool EnergySearch::has_fallen(const LinePoint& p) const {
    return is_finite(p) && p.energy <= c1 * p.length * start_slope_ + noise_;
}

double EnergySearch::inside() const {
    const double from = low_.length, to = end_->length;
    const double at = is_finite(*end_) ? cubic_minimum(low_, *end_) : NAN;
    const double share = (at - from) / (to - from);
    return from + (to - from) * (std::isfinite(share) ? std::clamp(share, 0.1, 0.9) : 0.25);
}

double EnergySearch::beyond(const LinePoint& before) const {
    // Where the slopes of the last two points say that the fall ends.
    const double turn = low_.slope - before.slope;
    const double root = turn > 0 ? low_.length - low_.slope * (low_.length - before.length) / turn
                                 : std::numeric_limits<double>::infinity();
    return std::clamp(root, min_growth * low_.length, max_growth * low_.length);
}

std::optional<double> EnergySearch::next(const LinePoint& found) {
    ++trials_;
    if (!has_fallen(found) || found.energy > low_.energy + noise_) {
        end_ = found;
        return trials_ < max_trials ? std::optional(inside()) : std::nullopt;
    }
    const LinePoint before = low_;
    low_ = found;
    if (std::abs(found.slope) <= c2 * std::abs(start_slope_) || trials_ == max_trials)
        return std::nullopt;
    if (found.slope * (found.length - before.length) > 0) end_ = before;
    return end_ ? inside() : beyond(before);
}

std::optional<LinePoint> EnergySearch::best() const {
    return low_.length > 0 ? std::optional(low_) : std::nullopt;
}

}  // namespace livetet
