#include "solvers/parallel/finer_share.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "base/error.hpp"
#include "mesh/node_selection.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/refine.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A block of two materials with a node set, and a set of triangles with their nodes.
TetMesh named_block() {
    TetMesh mesh = test::block({6, 4, 3}, test::beam_size);
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) mesh.regions.push_back(e % 3 == 0 ? 7 : 3);
    mesh.node_sets["corner"] = nodes_in_sphere(mesh, Vector3::Zero(), 0.6 * test::beam_size.x());
    for (const Triangle& t : boundary_triangles(mesh.tets))
        if (std::ranges::all_of(t, [&](std::int32_t n) { return mesh.nodes[n].x() < 1e-9; }))
            mesh.triangle_sets["face"].push_back(t);
    mesh.node_sets["face"] = nodes_of(mesh.triangle_sets["face"]);
    return mesh;
}

std::set<Triangle> sorted(std::vector<Triangle> triangles) {
    for (Triangle& t : triangles) std::ranges::sort(t);
    return {triangles.begin(), triangles.end()};
}

/// That a rank has made from its own part what `whole` has there.
void expect_share_of(const TetMesh& whole, const FinerShare& finer) {
    const PartitionedMesh& share = finer.share;
    ASSERT_EQ(share.total, whole.nodes.size());
    EXPECT_EQ(share.corners, corner_count(whole));
    // 1. nodes, each owned once, and all tets at own ones
    std::vector<int> owners(whole.nodes.size(), 0);
    for (std::size_t i = 0; i < share.nodes.size(); ++i) {
        EXPECT_EQ(share.rest[i], whole.nodes[share.nodes[i]]);
        if (static_cast<std::int32_t>(i) < share.owned) ++owners[share.nodes[i]];
    }
    MPI_Allreduce(MPI_IN_PLACE, owners.data(), static_cast<int>(owners.size()), MPI_INT, MPI_SUM,
                  PETSC_COMM_WORLD);
    EXPECT_TRUE(std::ranges::all_of(owners, [](int n) { return n == 1; }));
    EXPECT_EQ(share.numbers, petsc_numbers(share, share.nodes));
    EXPECT_TRUE(std::is_sorted(share.nodes.begin(), share.nodes.begin() + share.owned));
    const std::set<std::int32_t> own(share.nodes.begin(), share.nodes.begin() + share.owned);
    const auto is_own = [&](std::int32_t n) { return own.contains(n); };
    std::vector<std::int32_t> wanted;
    for (std::size_t e = 0; e < whole.tets.size(); ++e)
        if (std::ranges::any_of(whole.tets[e], is_own))
            wanted.push_back(static_cast<std::int32_t>(e));
    EXPECT_EQ(share.tet_ids, wanted);
    // 2. tets
    for (std::size_t e = 0; e < share.tets.size(); ++e) {
        const auto id = static_cast<std::size_t>(share.tet_ids[e]);
        EXPECT_EQ(share.regions[e], whole.regions[id]);
        for (int i = 0; i < share.nodes_per_tet(); ++i)
            EXPECT_EQ(share.nodes[share.node(e, i)],
                      i < 4 ? whole.tets[id][i] : whole.edge_nodes[id][i - 4]);
    }
    // 3. sets
    const LocalSets expected = local_sets(test::rows_of(whole), share);
    EXPECT_EQ(finer.sets.nodes, expected.nodes);
    ASSERT_EQ(finer.sets.triangles.size(), 1u);
    EXPECT_EQ(sorted(finer.sets.triangles.at("face")), sorted(expected.triangles.at("face")));
}

/// That own nodes lie in the coarse share where the rows say.
void expect_rows(const PartitionedMesh& coarse, const FinerShare& finer) {
    ASSERT_EQ(finer.in_coarse.size(), static_cast<std::size_t>(finer.share.owned));
    for (std::size_t i = 0; i < finer.in_coarse.size(); ++i) {
        EXPECT_LT((interpolate(finer.in_coarse, i, coarse.rest) - finer.share.rest[i]).norm(),
                  1e-15);
        EXPECT_LT(finer.in_coarse.nodes[i][0], coarse.owned);
    }
}

TEST(FinerShare, RanksMakeOfTheirPartsWhatIsMadeOfTheWhole) {
    if (test::rank_count() == 1) GTEST_SKIP() << "one rank refines the whole mesh";
    MeshHierarchy whole = make_hierarchy({named_block()}, "a block");
    const TetMesh& block = whole.levels.front();
    PartitionedMesh share =
        distribute_mesh(PETSC_COMM_WORLD, block, partition_tets(block.tets, test::rank_count()));
    LocalSets sets = local_sets(test::rows_of(block), share);
    for (int times = 0; times < 2; ++times) {
        const FinerShare quadratic = quadratic_share(share, sets);
        expect_share_of(quadratic_mesh(whole.levels.front()), quadratic);
        expect_rows(share, quadratic);
        whole = with_refined_levels(std::move(whole), 1);
        FinerShare refined = refined_share(share, sets);
        expect_share_of(whole.levels.front(), refined);
        expect_rows(share, refined);
        share = std::move(refined.share);
        sets = std::move(refined.sets);
    }
}

TEST(FinerShare, ATriangleThatIsNoFaceIsRefusedOnEveryRank) {
    TetMesh block = named_block();
    block.triangle_sets["face"][1] = {0, 1, static_cast<std::int32_t>(block.nodes.size()) - 1};
    const PartitionedMesh share =
        distribute_mesh(PETSC_COMM_WORLD, block, partition_tets(block.tets, test::rank_count()));
    try {
        (void)local_sets(test::rows_of(block), share);
        ADD_FAILURE() << "taken";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("set face: found a triangle 0, 1, "),
                  std::string::npos)
            << error.what();
    }
}

/// Ranks without a part do not stop the others.
TEST(FinerShare, SomeRanksMayHaveNothing) {
    if (test::rank_count() == 1) GTEST_SKIP() << "one rank refines the whole mesh";
    const TetMesh block = named_block();
    const PartitionedMesh share =
        distribute_mesh(PETSC_COMM_WORLD, block, std::vector<std::int32_t>(block.tets.size(), 0));
    const MeshHierarchy whole = with_refined_levels(make_hierarchy({block}, "a block"), 1);
    expect_share_of(whole.levels.front(),
                    refined_share(share, local_sets(test::rows_of(block), share)));
    expect_share_of(quadratic_mesh(block),
                    quadratic_share(share, local_sets(test::rows_of(block), share)));
}

}  // namespace
}  // namespace livetet
