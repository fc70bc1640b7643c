#include "mesh/hierarchy.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "base/error.hpp"
#include "mesh/shapes.hpp"

namespace livetet {
namespace {

const Vector3 block_size(0.1, 0.1, 0.1);
const TetMesh fine_block = shapes::box(block_size, {4, 4, 4}),
              coarse_block = shapes::box(block_size, {2, 2, 2});

std::string hierarchy_refusal(const std::function<void()>& work) {
    try {
        work();
    } catch (const Error& e) {
        return e.what();
    }
    return "accepted";
}

TEST(Hierarchy, IsMadeFromTheFinestLevelOn) {
    EXPECT_EQ(make_hierarchy({fine_block, coarse_block}, "").transfers.size(), 1u);
    EXPECT_EQ(hierarchy_refusal([] {
                  (void)make_hierarchy({coarse_block, fine_block}, "");
              }),
              "mesh hierarchy: found 48 tets in level 0 and 384 in level 1, expected the finest "
              "level first");
}

TEST(Hierarchy, RefusesMeshesThatAreNone) {
    EXPECT_EQ(hierarchy_refusal([] { (void)make_hierarchy({}, ""); }),
              "mesh hierarchy: found no levels, expected at least one mesh");
    EXPECT_EQ(hierarchy_refusal([] {
                  (void)make_hierarchy({fine_block, TetMesh{}}, "");
              }),
              "mesh hierarchy, level 1: the mesh has no tetrahedra, expected at least one");
    TetMesh far = fine_block, inverted = coarse_block;
    far.tets[5][2] = 125;
    std::swap(inverted.tets[3][0], inverted.tets[3][1]);
    EXPECT_EQ(hierarchy_refusal([&] {
                  (void)make_hierarchy({far, coarse_block}, "");
              }),
              "mesh hierarchy, level 0: tet 5 names node 125, expected 0 to 124");
    EXPECT_NE(hierarchy_refusal([&] {
                  (void)make_hierarchy({fine_block, inverted}, "");
              }).find("level 1: tet 3 at"),
              std::string::npos);
}

TEST(Hierarchy, RefusesTransfersThatDoNotFit) {
    MeshHierarchy hierarchy = make_hierarchy({fine_block, coarse_block}, "");
    EXPECT_EQ(hierarchy_refusal([&] { check_hierarchy(hierarchy); }), "accepted");
    hierarchy.transfers[0] = map_into(coarse_block, coarse_block.nodes);
    EXPECT_EQ(hierarchy_refusal([&] { check_hierarchy(hierarchy); }),
              "mesh hierarchy: transfer 0 has 27 points, expected the 125 nodes of level 0");
    hierarchy.transfers.clear();
    EXPECT_NE(hierarchy_refusal([&] { check_hierarchy(hierarchy); }), "accepted");
}

}  // namespace
}  // namespace livetet
