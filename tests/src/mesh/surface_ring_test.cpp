#include "mesh/surface_ring.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "mesh/quadratic.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

const Vector3 ringed_size(0.2, 0.1, 0.1);

TEST(SurfaceRing, LiesAroundThePatchAndIsExactForLinearFields) {
    for (const TetMesh& mesh : {test::block({24, 12, 12}, ringed_size),
                                quadratic_mesh(test::block({24, 12, 12}, ringed_size))}) {
        const double radius = 0.015;
        const SurfaceNeighbourhood around(mesh, {0.103, 0.024, 0.1});
        const SurfacePatch patch = around.patch(radius);
        const SurfaceRing ring = surface_ring(around, patch, radius);
        ASSERT_GT(ring.nodes.size(), 20u);
        EXPECT_LT((patch.normal - Vector3::UnitZ()).norm(), 1e-12);
        EXPECT_NEAR(std::accumulate(ring.weights.begin(), ring.weights.end(), 0.0), 1, 1e-12);
        const auto [least, most] = std::ranges::minmax(ring.weights);
        EXPECT_LT(least, 0.95 * most) << "it reaches over an edge, and is not symmetric";
        EXPECT_GE(least, 0);
        for (const std::int32_t n : ring.nodes) {
            const double away = (mesh.nodes[n] - patch.at).norm();
            EXPECT_GT(away, 1.25 * radius);
            EXPECT_LT(away, 2.5 * radius);
            EXPECT_FALSE(std::binary_search(patch.nodes.begin(), patch.nodes.end(), n));
        }
        const auto field = [](const Vector3& x) {
            return Vector3(1 + 2 * x.x() - x.y(), 0.3 - x.x(), 5 * x.y());
        };
        std::vector<Vector3> values;
        for (const Vector3& x : mesh.nodes) values.push_back(field(x));
        EXPECT_LT((ring.interpolate(values) - field(ring.middle)).norm(), 1e-12);
    }
}

TEST(SurfaceRing, OfALopsidedPatchNoWeightIsNegative) {
    const TetMesh mesh = test::block({12, 6, 6}, ringed_size);
    for (const Vector3& place : {Vector3(0, 0, 0.1), Vector3(0.2, 0.05, 0.1), Vector3(0.1, 0, 0)}) {
        const SurfaceNeighbourhood around(mesh, place);
        const SurfacePatch patch = around.patch(0.015);
        const SurfaceRing ring = surface_ring(around, patch, 0.015);
        ASSERT_FALSE(ring.nodes.empty());
        EXPECT_GE(*std::ranges::min_element(ring.weights), 0);
        EXPECT_NEAR(std::accumulate(ring.weights.begin(), ring.weights.end(), 0.0), 1, 1e-12);
        const Vector3 centre = 0.5 * ringed_size;
        EXPECT_GT(patch.normal.dot(place - centre), 0);
    }
}

TEST(SurfaceRing, ReachesFartherOnACoarseMeshAndIsEmptyWhereThereIsNothing) {
    const TetMesh coarse = test::block({6, 3, 3}, ringed_size);  // edges of 33 mm
    const Vector3 place(0.1, 0.033, 0.1);
    const double radius = 0.01;
    const SurfaceNeighbourhood around(coarse, place);
    const SurfaceRing ring = surface_ring(around, around.patch(radius), radius);
    EXPECT_GE(ring.nodes.size(), 6u);
    const SurfacePatch all = around.patch(1);
    EXPECT_TRUE(surface_ring(around, all, 1).nodes.empty());
    const std::vector<Vector3> values(coarse.nodes.size(), Vector3::Ones());
    EXPECT_EQ(surface_ring(around, all, 1).interpolate(values), Vector3::Zero());
}

}  // namespace
}  // namespace livetet
