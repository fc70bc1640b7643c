#include "meshing/surface_distance.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "mesh/shapes.hpp"

namespace livetet {
namespace {

NearestTriangle tree(const TriangleMesh& surface) { return {surface.nodes, surface.triangles}; }

TEST(SurfaceDistance, between_concentric_spheres_is_the_difference_of_radii) {
    const TriangleMesh small = shapes::sphere(0.05, 5), large = shapes::sphere(0.06, 5);
    const HausdorffDistance d = hausdorff_distance(small, large, tree(large));
    for (const SurfaceDistance& one : {d.to_body, d.from_body}) {
        EXPECT_NEAR(one.max_m, 0.01, 1e-4);
        EXPECT_NEAR(one.mean_m, 0.01, 1e-4);
    }
    EXPECT_NEAR(hausdorff_distance(large, large, tree(large)).to_body.max_m, 0, 1e-12);
}

TEST(SurfaceDistance, of_a_coarse_sphere_is_that_of_its_chords) {
    const TriangleMesh coarse = shapes::sphere(1, 1), fine = shapes::sphere(1, 5);
    const HausdorffDistance d = hausdorff_distance(coarse, fine, tree(fine));
    double deepest = 0;  // depth of the triangles' centres below the sphere
    for (const auto& [i, j, k] : coarse.triangles)
        deepest = std::max(deepest,
                           1 - ((coarse.nodes[i] + coarse.nodes[j] + coarse.nodes[k]) / 3).norm());
    EXPECT_NEAR(d.to_body.max_m, deepest, 0.02 * deepest);
    EXPECT_LT(d.to_body.mean_m, d.to_body.max_m);
}

/// The greatest distance is at a node; centres of pieces are up to a third of the spike away from
/// it.
TEST(SurfaceDistance, is_never_understated) {
    const TriangleMesh sphere = shapes::sphere(0.05, 3);
    TriangleMesh spiky = sphere;
    spiky.nodes[7] *= 1.4;
    for (const double spacing : {0.001, 0.01, 1.}) {
        const SurfaceDistance d = distance_between(spiky, tree(sphere), spacing);
        EXPECT_GE(d.max_m, 0.02 - 1e-12) << spacing;
        EXPECT_LE(d.max_m, 0.0203) << spacing;
        EXPECT_LT((d.farthest - spiky.nodes[7]).norm(), 0.001) << spacing;
    }
}

/// Only the surface with a spike sees it, the other one does not: both directions are needed.
TEST(SurfaceDistance, sees_a_spike_from_its_side_alone) {
    const TriangleMesh sphere = shapes::sphere(0.05, 4);
    TriangleMesh spiky = sphere;
    spiky.nodes[7] *= 1.4;
    const HausdorffDistance d = hausdorff_distance(sphere, spiky, tree(spiky));
    EXPECT_GT(d.from_body.max_m, 0.015);
    EXPECT_LT(d.to_body.max_m, 0.005);
    EXPECT_LT((d.from_body.farthest - spiky.nodes[7]).norm(), 0.006);
}

}  // namespace
}  // namespace livetet
