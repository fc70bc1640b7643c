#include "mesh/mesh_edges.hpp"

#include <gtest/gtest.h>

#include "support/shapes.hpp"

namespace livetet {
namespace {

TEST(MeshEdges, OfTwoTets) {
    const std::vector<Tet> tets{{3, 1, 0, 2}, {1, 2, 3, 4}};
    const Lists edges = edges_by_lower_end(tets, 6);
    EXPECT_EQ(edges.start, (std::vector<std::int32_t>{0, 3, 6, 8, 9, 9, 9}));
    EXPECT_EQ(edges.items, (std::vector<std::int32_t>{1, 2, 3, 2, 3, 4, 3, 4, 4}));
    EXPECT_EQ(edge_between(edges, 4, 1), 5);
    EXPECT_EQ(edge_between(edges, 0, 4), -1);
}

TEST(MeshEdges, OfABlockMeetItsEulerCharacteristic) {
    const TetMesh mesh = test::block({4, 3, 2}, test::beam_size);
    const auto nodes = static_cast<std::int64_t>(mesh.nodes.size()),
               edges = static_cast<std::int64_t>(
                   edges_by_lower_end(mesh.tets, mesh.nodes.size()).items.size()),
               tets = static_cast<std::int64_t>(mesh.tets.size()),
               outer = static_cast<std::int64_t>(boundary_triangles(mesh.tets).size());
    EXPECT_EQ(nodes - edges + (4 * tets + outer) / 2 - tets, 1);
}

}  // namespace
}  // namespace livetet
