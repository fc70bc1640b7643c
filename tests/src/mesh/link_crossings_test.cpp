// Links that many small surfaces cross, one after another.

#include "mesh/link_crossings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "base/error.hpp"
#include "mesh/hex_cut.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

/// z = h at random over [-1, 9]^2, in n^2 squares.
TriangleMesh rough_surface(int n, std::mt19937& random) {
    std::uniform_real_distribution<double> height(1, 7);
    TriangleMesh surface;
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i)
            surface.nodes.emplace_back(-1 + 10.0 * i / n, -1 + 10.0 * j / n, height(random));
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            const int a = j * (n + 1) + i;
            surface.triangles.push_back({a, a + 1, a + n + 2});
            surface.triangles.push_back({a, a + n + 2, a + n + 1});
        }
    return surface;
}

TEST(LinkCrossings, TrianglesOneByOneMarkWhatTheWholeSurfaceCrosses) {
    const TetMesh mesh = test::hex_grid({8, 8, 8}, {8, 8, 8});
    const HexLevel level = hex_level_of(mesh, "grid");
    const GridFrame frame = grid_frame(mesh, level);
    const LinkCrossings crossings(level, frame);
    std::mt19937 random(5);
    for (const int n : {1, 3, 10, 25}) {
        const TriangleMesh surface = rough_surface(n, random);
        const auto whole = crossed_links(level, frame, surface, "cut");
        std::vector<std::uint8_t> marked(level.links.size(), 0);
        std::size_t fresh = 0;
        for (const Triangle& t : surface.triangles)
            fresh += crossings.mark({surface.nodes, {t}}, marked, "cut");
        EXPECT_EQ(marked, whole) << n;
        EXPECT_EQ(fresh, static_cast<std::size_t>(std::ranges::count(whole, 1))) << n;
        EXPECT_EQ(crossings.mark(surface, marked, "cut"), 0U) << "all are marked";
    }
}

TEST(LinkCrossings, ASurfaceThatIsRefusedMarksNothing) {
    const TetMesh mesh = test::hex_grid({4, 4, 4}, {4, 4, 4});
    const HexLevel level = hex_level_of(mesh, "grid");
    const LinkCrossings crossings(level, grid_frame(mesh, level));
    std::vector<std::uint8_t> marked(level.links.size(), 0);
    const TriangleMesh surface{{{-9, -9, 2.2}, {30, -9, 2.2}, {-9, 30, 2.2}, {0, 0, 1e9}},
                               {{0, 1, 2}, {0, 1, 3}}};
    EXPECT_THROW(crossings.mark(surface, marked, "blade"), Error);
    EXPECT_EQ(std::ranges::count(marked, 1), 0);
}

}  // namespace
}  // namespace livetet
