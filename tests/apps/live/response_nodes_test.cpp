#include "apps/live/response_nodes.hpp"

#include <gtest/gtest.h>

#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A cube of 100 mm with edges of 10 mm along the axes.
TEST(ResponseNodes, ASetIsWidenedInsideOrAlongTheSurface) {
    const TetMesh cube = test::block({10, 10, 10}, {0.1, 0.1, 0.1});
    const auto below = [&](double z) {
        const auto nodes =
            test::nodes_where(cube, [&](const Vector3& x) { return x.z() < z + 1e-6; });
        return std::vector<int>(nodes.begin(), nodes.end());
    };
    const std::vector<int> floor = below(0);
    EXPECT_EQ(widened(cube, floor, NodeScope::all, 0.009), floor);
    EXPECT_EQ(widened(cube, floor, NodeScope::all, 0.011), below(0.01));
    EXPECT_EQ(widened(cube, floor, NodeScope::all, 0.021), below(0.02));
    const std::vector<int> along = widened(cube, floor, NodeScope::surface_only, 0.011);
    EXPECT_EQ(along.size(), floor.size() + 40) << "the rim of the next layer";
    EXPECT_TRUE(widened(cube, {}, NodeScope::all, 0.01).empty());
}

TEST(ResponseNodes, ANodeOfACoarseSurfaceHasTheNearestOfTheFineOne) {
    const Vector3 size(0.1, 0.1, 0.1);
    const TetMesh fine = test::block({4, 4, 4}, size), coarse = test::block({2, 2, 2}, size);
    const std::vector<std::int32_t> nearest = nearest_on_surface(coarse, fine);
    ASSERT_EQ(nearest.size(), coarse.nodes.size());
    int inside = 0;
    for (std::size_t n = 0; n < nearest.size(); ++n) {
        inside += nearest[n] < 0;
        if (nearest[n] >= 0) {
            EXPECT_LT((fine.nodes[nearest[n]] - coarse.nodes[n]).norm(), 1e-12);
        }
    }
    EXPECT_EQ(inside, 1) << "the centre";
    Holding held{Constraints(fine.nodes.size()), {}};
    held.constraints.components[nearest[0]] = 7;
    const Holding other = on_other_nodes(held, nearest);
    for (std::size_t n = 0; n < nearest.size(); ++n)
        EXPECT_EQ(other.constraints.components[n], n == 0 ? 7 : 0) << n;
}

}  // namespace
}  // namespace livetet
