#include "base/piece_sums.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace livetet {

namespace {

/// Numbers whose sum depends on the order in which they are added.
std::vector<double> uneven(std::size_t count) {
    std::vector<double> all(count);
    for (std::size_t i = 0; i < count; ++i)
        all[i] = 1.0 / static_cast<double>(1 + i * 7919 % 1009) - 0.004;
    return all;
}

}  // namespace

TEST(PieceSums, AddEachComponentOnce) {
    for (const std::size_t count : {0, 1, 31, 32, 1535, 1536, 1537, 98304, 98305, 300000}) {
        std::vector<double> a(count);
        std::iota(a.begin(), a.end(), 1.0);
        const std::vector<float> ones(count, 1.0F);
        ThreadTeam team(2);
        EXPECT_EQ(dot_on_team(team, ones.data(), a.data(), count),
                  0.5 * static_cast<double>(count) * static_cast<double>(count + 1))
            << count;
    }
}

TEST(PieceSums, HaveTheSameBitsOnAnyNumberOfThreads) {
    for (const std::size_t count : {5000, 250000}) {
        const std::vector<double> a = uneven(count);
        ThreadTeam one(1), three(3), four(4);
        const double sum = dot_on_team(one, a.data(), a.data(), count);
        EXPECT_EQ(sum, dot_on_team(three, a.data(), a.data(), count)) << count;
        EXPECT_EQ(sum, dot_on_team(four, a.data(), a.data(), count)) << count;
        EXPECT_NEAR(sum, std::inner_product(a.begin(), a.end(), a.begin(), 0.0), 1e-12 * sum);
    }
}

}  // namespace livetet
