// Bodies pressed in processes of their own.
#ifdef LIVETET_IMAGES

#include "apps/bench/accuracy_population.hpp"

#include <gtest/gtest.h>

namespace livetet {
namespace {

TEST(AccuracyPopulation, IsPressedInProcessesOfItsOwn) {
    const Population population{3, 1, 1, 800, 700, {{0.5, 0.2}}, {0.008}};
    double done = 0;
    const auto tables = press_population(population, [&](double fraction, std::string_view words) {
        EXPECT_GE(fraction, done) << "of all bodies together";
        EXPECT_EQ(words, "3 bodies");
        done = fraction;
    });
    EXPECT_GT(done, 0);
    EXPECT_LE(done, 1);
    ASSERT_EQ(tables.size(), 1u);
    const auto& runs = tables[0].by_sensors.at(0).runs;
    ASSERT_EQ(runs.size(), 3u);
    EXPECT_NEAR(tables[0].motion_mm[0], 4.1, 1);
    for (std::size_t b = 0; b < 3; ++b) {
        EXPECT_LT(runs[b][0].deforming, runs[b][0].rigid);
        EXPECT_NE(runs[b][0].deforming, runs[(b + 1) % 3][0].deforming) << "another body";
    }
}

}  // namespace
}  // namespace livetet
#endif
