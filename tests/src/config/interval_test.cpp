#include "config/interval.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "config/fields.hpp"

namespace livetet {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

TEST(Interval, ContainsItsEndsUnlessTheyAreExcluded) {
    const Interval closed{0, 1}, open{0, 1, Ends::excluded}, half{0, 1, Ends::low_excluded};
    for (const Interval& i : {closed, open, half}) {
        EXPECT_TRUE(i.contains(0.5));
        EXPECT_FALSE(i.contains(-1e-300));
        EXPECT_FALSE(i.contains(1 + 1e-15));
        EXPECT_FALSE(i.contains(std::nan("")));
    }
    EXPECT_TRUE(closed.contains(0) && closed.contains(1));
    EXPECT_FALSE(open.contains(0) || open.contains(1));
    EXPECT_TRUE(!half.contains(0) && half.contains(1));
}

TEST(Interval, AnUnlimitedEndContainsEveryNumber) {
    EXPECT_TRUE(Interval{}.contains(-1e308) && Interval{}.contains(1e308));
    EXPECT_TRUE((Interval{0, infinity, Ends::low_excluded}.contains(1e308)));
    EXPECT_FALSE((Interval{-infinity, 3}.contains(3.1)));
}

TEST(Interval, SaysItsBoundsInWords) {
    EXPECT_EQ((Interval{0.01, 100}.text()), "from 0.01 to 100");
    EXPECT_EQ((Interval{100, 20'000'000}.text()), "from 100 to 20000000");
    EXPECT_EQ((Interval{0, 1, Ends::excluded}.text()), "above 0 and below 1");
    EXPECT_EQ((Interval{0, 1, Ends::low_excluded}.text()), "above 0 and at most 1");
    EXPECT_EQ((Interval{.low = 0}.text()), "at least 0");
    EXPECT_EQ((Interval{.low = 1, .ends = Ends::low_excluded}.text()), "greater than 1");
    EXPECT_EQ((Interval{.high = 2}.text()), "at most 2");
    EXPECT_EQ((Interval{.high = 2, .ends = Ends::excluded}.text()), "less than 2");
    EXPECT_EQ(Interval{}.text(), "");
}

TEST(Check, AnIntervalHoldsForBothEndsOfASpread) {
    const Check<Uncertain> check = within<Uncertain>({0, 1, Ends::excluded}, ", and a reason");
    EXPECT_EQ(check.text, "above 0 and below 1, and a reason");
    EXPECT_TRUE(check.holds({0.5, 0.4}));
    EXPECT_FALSE(check.holds({0.5, 0.5}));
    EXPECT_FALSE(check.holds({0.1, 0.2}));
    EXPECT_FALSE(check.holds({0.9, 0.2}));
}

TEST(Check, AnIntervalLimitsTheNumberBesideAuto) {
    const Check<NumberOrAuto> check = within<NumberOrAuto>({0, 500});
    EXPECT_TRUE(check.holds({}));
    EXPECT_TRUE(check.holds({500}));
    EXPECT_FALSE(check.holds({501}));
}

TEST(Check, EveryEntryOfAListIsOneOfTheNames) {
    const Check<std::vector<std::string>> check = some_of({"stress", "reactions"});
    EXPECT_EQ(check.text, "some of stress, reactions");
    EXPECT_TRUE(check.holds({}));
    EXPECT_TRUE(check.holds({"reactions", "stress"}));
    EXPECT_FALSE(check.holds({"stress", "strain"}));
}

}  // namespace
}  // namespace livetet
