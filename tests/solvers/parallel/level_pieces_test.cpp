#include "solvers/parallel/level_pieces.hpp"

#include <gtest/gtest.h>

#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// Long bars and a small one between them, which ranks share in many parts.
TEST(LevelPieces, OfSharesAreThoseOfTheWholeMesh) {
    TetMesh mesh = test::block({30, 2, 2}, {0.3, 0.02, 0.02});
    for (const auto& [cells, size, place] :
         {std::tuple(std::array{2, 1, 1}, Vector3(0.02, 0.01, 0.01), Vector3(0.1, 0, 0.03)),
          std::tuple(std::array{24, 2, 2}, Vector3(0.3, 0.02, 0.02), Vector3(0, 0, 0.1))}) {
        const TetMesh other = test::block(cells, size);
        const auto count = static_cast<std::int32_t>(mesh.nodes.size());
        for (const Vector3& x : other.nodes) mesh.nodes.push_back(x + place);
        for (Tet t : other.tets) {
            for (std::int32_t& n : t) n += count;
            mesh.tets.push_back(t);
        }
    }
    const PartitionedMesh share =
        distribute_mesh(PETSC_COMM_WORLD, mesh, partition_tets(mesh.tets, test::rank_count()));
    const LevelPieces found = level_pieces(share), expected = level_pieces(mesh);
    ASSERT_EQ(found.all.size(), 3u);
    for (std::size_t p = 0; p < 3; ++p) {
        EXPECT_LT((found.all[p].centre - expected.all[p].centre).norm(), 1e-15);
        EXPECT_NEAR(found.all[p].extent, expected.all[p].extent, 1e-15);
        EXPECT_EQ(found.all[p].node, expected.all[p].node);
        EXPECT_EQ(found.all[p].tet, expected.all[p].tet);
    }
    ASSERT_EQ(found.of_node.size(), static_cast<std::size_t>(share.owned));
    for (std::size_t i = 0; i < found.of_node.size(); ++i)
        EXPECT_EQ(found.of_node[i], expected.of_node[share.nodes[i]]);
}

}  // namespace
}  // namespace livetet
