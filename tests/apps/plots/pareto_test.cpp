#include "apps/plots/pareto.hpp"

#include <gtest/gtest.h>

namespace livetet {
namespace {

TEST(Pareto, HoldsWhatNothingIsBetterThan) {
    EXPECT_EQ(pareto_front({4, 1, 2, 3, 2}, {1, 9, 5, 6, 5.5}),
              (std::vector<std::size_t>{1, 2, 0}));
    EXPECT_EQ(pareto_front({}, {}), std::vector<std::size_t>{});
    EXPECT_EQ(pareto_front({1, 1}, {2, 2}).size(), 1u);
}

}  // namespace
}  // namespace livetet
