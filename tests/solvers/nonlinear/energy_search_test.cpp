#include "solvers/nonlinear/energy_search.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace livetet {
namespace {

/// An energy along a line, and its slope.
struct Energy {
    std::function<double(double)> value, slope;
};

struct Found {
    std::optional<LinePoint> best;
    int trials = 0;
};

Found search_from(double length, const Energy& energy, double noise = 0) {
    EnergySearch search(energy.slope(0), noise);
    Found found;
    for (;;) {
        ++found.trials;
        const auto next =
            search.next({length, energy.value(length) - energy.value(0), energy.slope(length)});
        if (!next) break;
        length = *next;
    }
    found.best = search.best();
    return found;
}

/// The strong Wolfe conditions, as the docstring has them.
void expect_good(const Energy& energy, const Found& found) {
    ASSERT_TRUE(found.best);
    const double a = found.best->length, start = energy.slope(0);
    EXPECT_LE(energy.value(a), energy.value(0) + 1e-4 * a * start);
    EXPECT_LE(std::abs(energy.slope(a)), 0.5 * std::abs(start));
}

TEST(EnergySearch, TakesTheWholeStepOfAParabola) {
    const Energy parabola{[](double a) { return a * a / 2 - a; }, [](double a) { return a - 1; }};
    const Found found = search_from(1, parabola);
    expect_good(parabola, found);
    EXPECT_EQ(found.trials, 1);
    EXPECT_EQ(found.best->length, 1);
}

TEST(EnergySearch, FindsTheMinimumOfAParabolaFromAnyLength) {
    const Energy parabola{[](double a) { return a * a / 2 - a; }, [](double a) { return a - 1; }};
    for (const double length : {1e-3, 0.1, 4., 1e3}) {
        const Found found = search_from(length, parabola);
        expect_good(parabola, found);
        EXPECT_LE(found.trials, 7) << length;
    }
}

TEST(EnergySearch, GoesOnWhereTheEnergyFallsEverMoreSteeply) {
    // Negative curvature until far beyond the first length.
    const Energy hill{[](double a) { return -a - a * a + std::pow(a / 10, 4); },
                      [](double a) { return -1 - 2 * a + 0.4 * std::pow(a / 10, 3); }};
    const Found found = search_from(1, hill);
    ASSERT_TRUE(found.best);
    EXPECT_GT(found.best->length, 50);
    expect_good(hill, found);
}

TEST(EnergySearch, ComesBackFromAnotherValleyThatIsHigher) {
    // At length 1 the slope is as gentle as one could wish, but the energy has risen.
    const Energy valleys{[](double a) { return -0.1 * std::sin(20 * a) + a * a; },
                         [](double a) { return -2 * std::cos(20 * a) + 2 * a; }};
    EXPECT_LE(std::abs(valleys.slope(1.2)), std::abs(valleys.slope(0)));
    const Found found = search_from(1.2, valleys);
    expect_good(valleys, found);
    EXPECT_LT(found.best->length, 0.2);
}

TEST(EnergySearch, ComesBackFromWhereThereIsNoEnergy) {
    const auto barrier = [](double a) { return a < 0.01 ? -std::log(0.01 - a) - 300 * a : NAN; };
    const Energy walled{barrier, [](double a) { return a < 0.01 ? 1 / (0.01 - a) - 300 : NAN; }};
    const Found found = search_from(1, walled);
    expect_good(walled, found);
}

TEST(EnergySearch, HasNoBestLengthWhereNothingFalls) {
    // The slope is wrong: the energy rises.
    const Energy wrong{[](double a) { return a; }, [](double a) { return a == 0 ? -1. : 1.; }};
    const Found found = search_from(1, wrong);
    EXPECT_FALSE(found.best);
    EXPECT_EQ(found.trials, EnergySearch::max_trials);
}

TEST(EnergySearch, TakesAStepWhoseGainIsLostInRounding) {
    const Energy flat{[](double a) { return 3e-9 * a; }, [](double a) { return 1e-9 * (a - 1); }};
    EXPECT_FALSE(search_from(1, flat).best);
    const Found found = search_from(1, flat, 1e-8);
    ASSERT_TRUE(found.best);
    EXPECT_EQ(found.best->length, 1);
}

TEST(EnergySearch, EndsWhereTheEnergyHasNoBottom) {
    const Energy falls{[](double a) { return -a; }, [](double) { return -1.; }};
    const Found found = search_from(1, falls);
    EXPECT_EQ(found.trials, EnergySearch::max_trials);
    ASSERT_TRUE(found.best);
    EXPECT_GT(found.best->length, 1e3);
}

}  // namespace
}  // namespace livetet
