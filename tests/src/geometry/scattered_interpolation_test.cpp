#include "geometry/scattered_interpolation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/error.hpp"

namespace livetet {
namespace {

/// Places in a cube of edge 1, and a value for each.
struct Cloud {
    std::vector<Eigen::Vector3d> places;
    std::vector<double> values;

    explicit Cloud(std::size_t count) {
        std::mt19937_64 random(7);
        std::uniform_real_distribution<double> share;
        for (std::size_t i = 0; i < count; ++i) {
            const double x = share(random), y = share(random), z = share(random);
            places.emplace_back(x, y, z);
            values.push_back(share(random));
        }
    }
    std::vector<double> along(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                              int steps) const {
        std::vector<Eigen::Vector3d> points;
        for (int i = 0; i <= steps; ++i)
            points.push_back(from + static_cast<double>(i) / steps * (to - from));
        const ScatteredInterpolation interpolated(places, points);
        std::vector<double> found;
        for (std::size_t i = 0; i < points.size(); ++i) found.push_back(interpolated(i, values));
        return found;
    }
};

TEST(ScatteredInterpolation, HasThePlacesValuesThereAndIsBetweenThemElsewhere) {
    const Cloud cloud(96);
    const ScatteredInterpolation at_places(cloud.places, cloud.places);
    ASSERT_EQ(at_places.size(), cloud.places.size());
    for (std::size_t i = 0; i < cloud.places.size(); ++i)
        EXPECT_EQ(at_places(i, cloud.values), cloud.values[i]);
    const auto [least, most] = std::ranges::minmax(cloud.values);
    for (const double value : cloud.along({-1, 0, 0}, {2, 1, 1}, 1000)) {
        EXPECT_GE(value, least - 1e-12);
        EXPECT_LE(value, most + 1e-12);
    }
}

TEST(ScatteredInterpolation, HasNoJumps) {
    const std::vector<double> values = Cloud(96).along({0, 0.1, 0.2}, {1, 0.9, 0.7}, 100000);
    double largest = 0;
    for (std::size_t i = 1; i < values.size(); ++i)
        largest = std::max(largest, std::abs(values[i] - values[i - 1]));
    EXPECT_LT(largest, 0.005);
    const auto [least, most] = std::ranges::minmax(values);
    EXPECT_GT(most - least, 0.2) << "and is not constant";
}

TEST(ScatteredInterpolation, WeighsTheNearestByTheirDistances) {
    // Distances 1, 2, 4, 4 and, for the fifth, 8: weights 49/64, 9/64, 1/64, 1/64.
    const std::vector<Eigen::Vector3d> places{
        {8, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 4}, {0, -4, 0}};
    const std::vector<Eigen::Vector3d> points{{0, 0, 0}};
    const std::vector<double> values{1e6, 1, 2, 3, 5};
    EXPECT_NEAR(ScatteredInterpolation(places, points)(0, values), (49 + 18 + 3 + 5) / 60.0, 1e-12);
}

TEST(ScatteredInterpolation, FewPlacesSufficeAndNoneAreRefused) {
    const std::vector<Eigen::Vector3d> points{{0, 0, 0}};
    std::vector<Eigen::Vector3d> places{{1, 0, 0}};
    EXPECT_EQ(ScatteredInterpolation(places, points)(0, std::vector{7.0}), 7);
    places.emplace_back(0, -2, 0);  // a quarter of the first's weight
    EXPECT_NEAR(ScatteredInterpolation(places, points)(0, std::vector{1.0, 6.0}), 2, 1e-12);
    const std::vector<Eigen::Vector3d> round{
        {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
    EXPECT_EQ(ScatteredInterpolation(round, points)(0, std::vector(5, 3.0)), 3)
        << "the fifth is as near";
    EXPECT_THROW(ScatteredInterpolation({}, points), Error);
}

}  // namespace
}  // namespace livetet
