#pragma once

#include <optional>

namespace livetet {

/// A place on the line u + length d of a line search.
struct LinePoint {
    double length = 0;
    double energy = 0;  ///< above that of length 0, J
    double slope = 0;   ///< derivative of the energy by the length, J
};

/// Line search on an energy that need not be convex: for a length at which the energy has fallen
/// enough, and is no longer as steep as at the start (the strong Wolfe conditions, with c1 = 1e-4
/// and c2 = 0.5),
///
///     E(a) <= E(0) + c1 a E'(0),      |E'(a)| <= c2 |E'(0)|.
///
/// Where the energy still falls too steeply it goes on to longer steps, as it must along a
/// direction of negative curvature, whose length says nothing. Else it narrows a bracket by the
/// minimum of the cubic through both ends. Source: Nocedal and Wright, Numerical Optimization
/// (2006), algorithms 3.5 and 3.6.
///
///     EnergySearch search(slope, noise);
///     double length = 1;
///     while (const auto next = search.next(point_at(length))) length = *next;
///     // search.best(): empty if no length will do
class EnergySearch {
  public:
    /// `slope`: of the energy at length 0, J, negative. `noise`: differences of the energy, J, that
    /// are rounding.
    EnergySearch(double slope, double noise)
        : start_slope_(slope), noise_(noise), low_{0, 0, slope} {}

    /// Takes what was found at the last length that was asked for (the first: any). Returns the
    /// next length to try, or nothing at the end.
    std::optional<double> next(const LinePoint& found);

    /// The length to take; of those tried, the lowest that has fallen enough. Empty if there is
    /// none.
    std::optional<LinePoint> best() const;

    static constexpr int max_trials = 10;

  private:
    bool has_fallen(const LinePoint& p) const;
    double inside() const;                         ///< the bracket
    double beyond(const LinePoint& before) const;  ///< low_, which still falls

    double start_slope_, noise_;
    LinePoint low_;                 ///< lowest point so far that has_fallen; at first the start
    std::optional<LinePoint> end_;  ///< the other end of the bracket
    int trials_ = 0;
};

}  // namespace livetet
