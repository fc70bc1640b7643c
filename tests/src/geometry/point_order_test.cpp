#include "geometry/point_order.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "geometry/umeyama.hpp"
#include "support/points.hpp"

namespace livetet {
namespace {

using namespace test;

TEST(PointOrder, FindsTheOrderThatFits) {
    Random random(9);
    for (const std::size_t count : {4, 8}) {
        const Points p = random.points(count, 0.1);
        const Points x = mapped(Truth{1, random.rotation(), random.vector(0.5)}, p);
        EXPECT_FALSE(better_order(p, x));
        Points swapped = p;
        std::swap(swapped[1], swapped[3]);
        const auto better = better_order(swapped, x);
        ASSERT_TRUE(better);
        for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(swapped[better->order[i]], p[i]);
        EXPECT_LT(better->fre, 1e-8);
        EXPECT_NEAR(better->given_fre, fit_points(swapped, x, Scaling::rigid).fre, 1e-12);
    }
}

TEST(PointOrder, BadPointsAreNotExplainedByAnotherOrder) {
    Random random(10);
    const Points p = random.points(5, 0.1);
    Points x = mapped(Truth{1, random.rotation(), random.vector(0.5)}, p);
    for (Vector3d& point : x) point += random.gaussian(0.004);
    EXPECT_GT(fit_points(p, x, Scaling::rigid).fre, 0.003);
    EXPECT_FALSE(better_order(p, x));
}

// Tries all orders.
std::vector<PointOrder> all_orders(const Points& from, const Points& to) {
    std::vector<std::size_t> order(from.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::vector<PointOrder> orders;
    do {
        Points permuted;
        for (const std::size_t i : order) permuted.push_back(from[i]);
        orders.push_back({order, fit_points(permuted, to, Scaling::rigid).fre});
    } while (std::next_permutation(order.begin(), order.end()));
    std::sort(orders.begin(), orders.end(),
              [](const auto& a, const auto& b) { return a.fre < b.fre; });
    return orders;
}

TEST(PointOrder, IsTheBestAndTheNextBestOfAll) {
    Random random(11);
    for (int trial = 0; trial < 30; ++trial) {
        const std::size_t count = 3 + trial % 4;
        const Points p = random.points(count, 0.1);
        // From points that fit to unrelated points.
        Points x = mapped(Truth{1, random.rotation(), random.vector(0.5)}, p);
        for (Vector3d& point : x) point += random.gaussian(0.003 * trial);
        std::shuffle(x.begin(), x.end(), std::mt19937_64(trial));
        const auto expected = all_orders(p, x);
        const OrderSearch found = find_order(p, x);
        EXPECT_EQ(found.best.order, expected[0].order) << trial;
        EXPECT_NEAR(found.best.fre, expected[0].fre, 1e-9);
        EXPECT_EQ(found.rival.order, expected[1].order) << trial;
        EXPECT_NEAR(found.rival.fre, expected[1].fre, 1e-9);
    }
}

TEST(PointOrder, TenNoisyPointsAreFoundAmongAllTheirOrders) {
    Random random(12);
    for (int trial = 0; trial < 20; ++trial) {
        const Points p = random.points(10, 0.1);
        std::vector<std::size_t> order(10);
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::shuffle(order.begin(), order.end(), std::mt19937_64(trial));
        const Truth truth{1, random.rotation(), random.vector(0.5)};
        Points x;
        for (const std::size_t i : order) x.push_back(truth * p[i] + random.gaussian(0.001));
        const OrderSearch found = find_order(p, x);
        EXPECT_EQ(found.best.order, order);
        EXPECT_FALSE(is_ambiguous(found)) << 1e3 * found.best.fre << " " << 1e3 * found.rival.fre;
    }
}

TEST(PointOrder, TenPointsWithoutLikenessAreSearchedToTheEnd) {
    Random random(16);
    const Points p = random.points(10, 0.1), x = random.points(10, 0.1);
    const OrderSearch found = find_order(p, x);
    EXPECT_LE(found.best.fre, found.rival.fre);
    std::vector<std::size_t> order = found.best.order;
    for (std::size_t i = 0; i < 10; ++i)  // no swap of two or three points improves it
        for (std::size_t j = 0; j < 10; ++j)
            for (std::size_t k = 0; k < 10; ++k) {
                std::vector<std::size_t> other = order;
                std::swap(other[i], other[j]);
                std::swap(other[j], other[k]);
                if (other == order) continue;
                Points permuted;
                for (const std::size_t n : other) permuted.push_back(p[n]);
                EXPECT_GE(fit_points(permuted, x, Scaling::rigid).fre, found.rival.fre - 1e-9);
            }
}

TEST(PointOrder, SaysWhereTwoOrdersFitWithinTheNoise) {
    Random random(13);
    const Points square{{0.05, 0, 0}, {0, 0.05, 0}, {-0.05, 0, 0}, {0, -0.05, 0}};
    EXPECT_NEAR(nearest_symmetry(square).fre, 0, 1e-9);
    EXPECT_TRUE(is_ambiguous(find_order(square, square)));
    Points noisy = square;
    for (Vector3d& point : noisy) point += random.gaussian(0.001);
    EXPECT_TRUE(is_ambiguous(find_order(noisy, square)));

    // An isosceles triangle maps onto itself when turned over; one with three different sides does
    // not.
    EXPECT_NEAR(nearest_symmetry(Points{{-0.05, 0, 0}, {0.05, 0, 0}, {0, 0.07, 0}}).fre, 0, 1e-9);
    EXPECT_GT(nearest_symmetry(Points{{-0.05, 0, 0}, {0.05, 0, 0}, {0.03, 0.04, 0}}).fre, 0.004);
    // A mirror image is a different layout.
    const Points chiral{
        {0.05, 0, 0}, {-0.05, 0, 0}, {0.05, 0.06, 0}, {-0.05, 0.06, 0}, {0.05, 0, 0.07}};
    EXPECT_GT(nearest_symmetry(chiral).fre, 0.01);
}

TEST(PointOrder, MovesASquaresCornerUntilItsOrderIsTold) {
    Points layout{{0.05, 0, 0}, {0, 0.05, 0}, {-0.05, 0, 0}, {0, -0.05, 0}};
    double before = nearest_symmetry(layout).fre;
    for (const double moved : {0.005, 0.01, 0.02}) {
        layout[0] = {0.05 + moved, moved, 0};
        const double now = nearest_symmetry(layout).fre;
        EXPECT_GT(now, before + 0.0005);
        before = now;
    }
}

TEST(PointOrder, RefusesMoreThanTenPointsAndTooFew) {
    Random random(14);
    const Points eleven = random.points(11, 0.1), two = random.points(2, 0.1);
    EXPECT_NE(
        message_of([&] { find_order(eleven, eleven); }).find("11 of them, expected at most 10"),
        std::string::npos);
    EXPECT_THROW(find_order(two, two), Error);
    Points shuffled = eleven;
    std::swap(shuffled[0], shuffled[1]);
    EXPECT_FALSE(better_order(shuffled, eleven));
}

}  // namespace
}  // namespace livetet
