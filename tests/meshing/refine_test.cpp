#include "mesh/refine.hpp"

#include <gtest/gtest.h>

#include "mesh/node_selection.hpp"
#include "mesh/shapes.hpp"
#include "meshing/quality.hpp"

namespace livetet {
namespace {

MeshHierarchy block_hierarchy() {
    TetMesh fine = shapes::box({0.03, 0.02, 0.02}, {3, 2, 2});
    for (std::size_t e = 0; e < fine.tets.size(); ++e) fine.regions.push_back(e % 2 ? 7 : 3);
    fine.node_sets["left"] = nodes_in_box(fine, {-1, -1, -1}, {1e-9, 1, 1});
    for (const Triangle& t : boundary_triangles(fine.tets))
        if (fine.nodes[t[0]].x() < 1e-9 && fine.nodes[t[1]].x() < 1e-9 &&
            fine.nodes[t[2]].x() < 1e-9)
            fine.triangle_sets["left"].push_back(t);
    return make_hierarchy({fine, shapes::box({0.03, 0.02, 0.02}, {2, 1, 1})}, "block");
}

TEST(Refine, EightTetsForOneFillTheSameBodyWithItsRegionsAndSets) {
    const MeshHierarchy before = block_hierarchy(), after = with_refined_levels(before, 2);
    ASSERT_EQ(after.levels.size(), 4u);
    ASSERT_EQ(after.transfers.size(), 3u);
    for (int l = 1; l >= 0; --l) {
        const TetMesh &fine = after.levels[l], &coarse = after.levels[l + 1];
        check_tet_mesh(fine, "refined");
        EXPECT_EQ(fine.tets.size(), 8 * coarse.tets.size());
        EXPECT_NEAR(volume(fine), volume(before.levels[0]), 1e-15);
        double of_seven = 0;
        for (std::size_t e = 0; e < fine.tets.size(); ++e)
            if (fine.regions[e] == 7) of_seven += signed_volume(fine, fine.tets[e]);
        EXPECT_NEAR(of_seven, volume(fine) / 2, 1e-12);
        EXPECT_EQ(fine.node_sets.at("left"), nodes_in_box(fine, {-1, -1, -1}, {1e-9, 1, 1}));
        EXPECT_EQ(nodes_of(fine.triangle_sets.at("left")), fine.node_sets.at("left"));
        EXPECT_EQ(fine.triangle_sets.at("left").size(), 4 * coarse.triangle_sets.at("left").size());
        EXPECT_EQ(boundary_triangles(fine.tets).size(),
                  4 * boundary_triangles(coarse.tets).size());  // conforming
    }
}

TEST(Refine, EachNodeLiesWhereItsWeightsSay) {
    const MeshHierarchy after = with_refined_levels(block_hierarchy(), 2);
    for (int l = 0; l < 2; ++l) {
        const TetMesh &fine = after.levels[l], &coarse = after.levels[l + 1];
        ASSERT_EQ(after.transfers[l].size(), fine.nodes.size());
        for (std::size_t n = 0; n < fine.nodes.size(); ++n)
            ASSERT_LT((interpolate(after.transfers[l], n, coarse.nodes) - fine.nodes[n]).norm(),
                      1e-15);
    }
}

TEST(Refine, AnglesStayBounded) {
    MeshHierarchy hierarchy = block_hierarchy();
    hierarchy.levels[0].nodes[5] += Vector3(1e-3, -2e-3, 1e-3);  // breaks the symmetry
    const double before = measure_quality(hierarchy.levels[0]).min_dihedral_deg;
    EXPECT_GT(measure_quality(with_refined_levels(hierarchy, 3).levels[0]).min_dihedral_deg,
              0.5 * before);
}

}  // namespace
}  // namespace livetet
