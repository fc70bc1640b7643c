#include "geometry/spread_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.hpp"
#include "support/points.hpp"

namespace livetet {
namespace {

TEST(SpreadPoints, TakesTheEndsOfALineThenItsMiddle) {
    std::vector<Vector3> line;
    for (int i = 0; i <= 8; ++i) line.emplace_back(0.01 * i, 0, 0);
    const SpreadPoints spread = spread_points(line, 4);
    EXPECT_EQ(spread.chosen, (std::vector<std::size_t>{0, 8, 4, 2}));
    EXPECT_NEAR(spread.radius, 0.02, 1e-12);  // of the point at 0.06, between 0.04 and 0.08
    EXPECT_EQ(spread_points(line, 1).radius, 0.08);
    EXPECT_EQ(spread_points(line, line.size()).radius, 0);
}

/// The bound of the algorithm: those chosen are at least the radius apart.
TEST(SpreadPoints, AreAsFarApartAsTheyCover) {
    test::Random random(5);
    const std::vector<Vector3> points = random.points(300, 0.1);
    for (const std::size_t count : {2U, 7U, 40U}) {
        const SpreadPoints spread = spread_points(points, count);
        ASSERT_EQ(spread.chosen.size(), count);
        double farthest = 0, least = 1;
        for (const Vector3& x : points) {
            double nearest = 1;
            for (const std::size_t c : spread.chosen)
                nearest = std::min(nearest, (x - points[c]).norm());
            farthest = std::max(farthest, nearest);
        }
        for (const std::size_t a : spread.chosen)
            for (const std::size_t b : spread.chosen)
                if (a != b) least = std::min(least, (points[a] - points[b]).norm());
        EXPECT_NEAR(spread.radius, farthest, 1e-12);
        EXPECT_GE(least, spread.radius);
    }
}

TEST(SpreadPoints, RefusesMoreThanThereAre) {
    EXPECT_THROW((void)spread_points(std::vector<Vector3>(3, Vector3::Zero()), 4), Error);
    EXPECT_THROW((void)spread_points(std::vector<Vector3>(3, Vector3::Zero()), 0), Error);
}

}  // namespace
}  // namespace livetet
