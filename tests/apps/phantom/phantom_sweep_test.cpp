// The way of a simulated stylus over a surface.
#ifdef LIVETET_IMAGES
#include "apps/phantom/phantom_sweep.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "geometry/nearest_triangle.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

TriangleMesh surface_of(const TetMesh& mesh) { return {mesh.nodes, boundary_triangles(mesh.tets)}; }

TEST(PhantomSweep, LeadsOverTheTopInRowsWithEqualSteps) {
    const TriangleMesh surface = surface_of(test::block({4, 4, 2}, {0.08, 0.06, 0.04}));
    const SweepPath path{.row_m = 0.01, .step_m = 0.004};
    const std::vector<Vector3> places = sweep_path(surface, path);
    EXPECT_EQ(places.size(), 6U * 20U);
    for (std::size_t i = 0; i < places.size(); ++i) {
        EXPECT_NEAR(places[i].z(), 0.04, 1e-12) << "place " << i;
        if (i > 0) {
            EXPECT_LT((places[i] - places[i - 1]).norm(), path.row_m + 1e-9) << "place " << i;
        }
    }
}

TEST(PhantomSweep, GoesThroughTheAirOverSteepPlacesAndNeverBelow) {
    // A block with a pit of 20 mm in the middle of its top.
    TetMesh block = test::block({40, 10, 4}, {0.08, 0.06, 0.04});
    for (Vector3& x : block.nodes)
        if (x.z() > 0.0399 && std::abs(x.x() - 0.04) < 0.0101) x.z() -= 0.02;
    const TriangleMesh surface = surface_of(block);
    const std::vector<Vector3> places = sweep_path(surface, {.row_m = 0.02, .step_m = 0.001});
    const NearestTriangle nearest(surface.nodes, surface.triangles);
    std::size_t on_it = 0, in_the_pit = 0, in_the_air = 0;
    for (const Vector3& x : places) {
        if (nearest.find(x).distance > 1e-9)
            ++in_the_air;
        else
            ++on_it;
        if (x.z() < 0.021) ++in_the_pit;
    }
    EXPECT_GT(on_it, places.size() / 2);
    EXPECT_GT(in_the_pit, 20U);
    EXPECT_GT(in_the_air, 20U);
}

TEST(PhantomSweep, RefusesASurfaceThatIsSeenFromNowhereAbove) {
    TriangleMesh surface = surface_of(test::block({2, 2, 2}, {0.02, 0.02, 0.02}));
    for (Triangle& t : surface.triangles) std::swap(t[0], t[1]);  // inside out
    std::erase_if(surface.triangles, [&](const Triangle& t) {
        return surface.nodes[t[0]].z() < 0.01;  // the lower side would look up
    });
    EXPECT_THROW((void)sweep_path(surface, {}), Error);
}

}  // namespace
}  // namespace livetet
#endif
