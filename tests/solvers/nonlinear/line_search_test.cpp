#include "solvers/nonlinear/line_search.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace livetet {
namespace {

struct LineSearchTrial {
    const char* what;
    double slope_before, slope_after, norm_before, norm_after, length;
    std::optional<double> next;
};

TEST(LineSearch, NextLengthIsTheTable) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const LineSearchTrial table[] = {
        {"the energy still falls", 1, 0.5, 1, 3, 1, {}},
        {"it rises 0.9 times as steeply as it fell", 1, -0.9, 1, 3, 1, {}},
        {"it rises more steeply, but |r| has halved", 1, -5, 1, 0.5, 1, {}},
        {"the slope's root, by a secant", 1, -4, 1, 0.51, 1, 0.2},
        {"the same from a shorter length", 1, -4, 1, 2, 0.5, 0.1},
        {"no less than a tenth", 1, -99, 1, 2, 1, 0.1},
        {"no more than half", 1, -0.95, 1, 2, 1, 0.5},
        {"no slope before: |r| has decreased", 0, 5, 1, 0.9998, 1, {}},
        {"no slope before: |r| has hardly decreased", 0, 5, 1, 0.99995, 1, 0.5},
        {"no slope before: at half the length that is enough", 0, 5, 1, 0.99995, 0.5, {}},
        {"uphill: halving is not asked for", -1, 5, 1, 0.9, 1, {}},
        {"uphill: |r| has grown", -1, -5, 1, 1.1, 0.5, 0.25},
        {"|r| is not a number", 1, 1, 1, nan, 1, 0.5},
        {"|r| is not a number, nor the slope", 1, nan, 1, nan, 0.5, 0.25},
        {"|r| is infinite", 1, -9, 1, infinity, 1, 0.1},
        {"|r| is infinite, no slope before", 0, nan, 1, infinity, 1, 0.5},
    };
    for (const LineSearchTrial& t : table) {
        const auto next =
            next_length(t.slope_before, t.slope_after, t.norm_before, t.norm_after, t.length);
        ASSERT_EQ(next.has_value(), t.next.has_value()) << t.what;
        if (next) {
            EXPECT_NEAR(*next, *t.next, 1e-15) << t.what;
        }
    }
}

}  // namespace
}  // namespace livetet
