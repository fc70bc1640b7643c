#ifdef LIVETET_IMAGES
#include <gtest/gtest.h>

#include <algorithm>

#include "apps/viewer/body.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// On Loop's rounded surface, nodes at the rim of a cut lie in tets of the other side. Drawn with
/// those, triangles spanned the gap.
TEST(DrawnSurface, NodesMoveWithTetsOfTheirOwnSideOfACut) {
    TetMesh below = test::block({6, 4, 3}, {0.12, 0.08, 0.03}), both = below;
    const auto count = static_cast<std::int32_t>(below.nodes.size());
    for (const Vector3& x : below.nodes) both.nodes.push_back(x + Vector3(0, 0, 0.03));
    for (const Tet& t : below.tets)
        both.tets.push_back({t[0] + count, t[1] + count, t[2] + count, t[3] + count});
    const DrawnSurface surface = render_surface(both);
    ASSERT_EQ(surface.tets.size(), surface.nodes.size());
    EXPECT_GE(surface.triangles.size(), 10000u);
    const auto is_above = [&](std::int32_t n) { return surface.tets[n][0] >= count; };
    std::size_t above = 0;
    for (const Triangle& t : surface.triangles) {
        EXPECT_EQ(is_above(t[0]), is_above(t[1]));
        EXPECT_EQ(is_above(t[0]), is_above(t[2]));
        above += is_above(t[0]);
    }
    EXPECT_EQ(above, surface.triangles.size() / 2);
    for (std::size_t n = 0; n < surface.nodes.size(); ++n) {
        double nearest = 1;
        for (const std::int32_t corner : surface.tets[n])
            nearest = std::min(nearest, (both.nodes[corner] - surface.nodes[n]).norm());
        EXPECT_LT(nearest, 0.025) << "an edge is 0.02 m long";
    }
}

}  // namespace
}  // namespace livetet
#endif
