#include "solvers/parallel/partitioned_mesh.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <set>

#include "mesh/quadratic.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

/// A P1 and a P2 block on all ranks.
class PartitionedMeshTest : public testing::TestWithParam<bool> {
  protected:
    void SetUp() override {
        MeshHierarchy h = make_hierarchy({test::block({6, 4, 3}, test::beam_size)}, "a block");
        if (GetParam()) h = with_quadratic_level(std::move(h));
        whole = h.levels.front();
        for (std::size_t t = 0; t < whole.tets.size(); ++t)
            whole.regions.push_back(static_cast<std::int32_t>(t % 3));
        const int ranks = test::rank_count();
        mesh = distribute_mesh(PETSC_COMM_WORLD, whole, partition_tets(whole.tets, ranks));
    }
    TetMesh whole;
    PartitionedMesh mesh;
};

TEST_P(PartitionedMeshTest, EveryNodeHasOneOwnerAndOneNumber) {
    std::vector<int> owners(whole.nodes.size(), 0);
    for (std::int32_t i = 0; i < mesh.owned; ++i) ++owners[mesh.nodes[i]];
    MPI_Allreduce(MPI_IN_PLACE, owners.data(), static_cast<int>(owners.size()), MPI_INT, MPI_SUM,
                  PETSC_COMM_WORLD);
    EXPECT_TRUE(std::all_of(owners.begin(), owners.end(), [](int n) { return n == 1; }));
    const std::vector<PetscInt> number_of_node =
        petsc_numbers(mesh, test::numbers_to(whole.nodes.size()));
    std::set<PetscInt> numbers(number_of_node.begin(), number_of_node.end());
    EXPECT_EQ(numbers.size(), whole.nodes.size());
    EXPECT_EQ(*numbers.begin(), 0);
    EXPECT_EQ(*numbers.rbegin(), static_cast<PetscInt>(whole.nodes.size()) - 1);
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
        EXPECT_EQ(mesh.numbers[i], number_of_node[mesh.nodes[i]]);
    for (std::int32_t i = 1; i < mesh.owned; ++i)
        EXPECT_EQ(mesh.numbers[i], mesh.numbers[i - 1] + 1);
}

TEST_P(PartitionedMeshTest, EveryTetAtAnOwnedNodeIsLocal) {
    std::set<std::int32_t> local(mesh.tet_ids.begin(), mesh.tet_ids.end());
    std::set<std::int32_t> owned(mesh.nodes.begin(), mesh.nodes.begin() + mesh.owned);
    for (std::size_t t = 0; t < whole.tets.size(); ++t) {
        const bool touches = std::any_of(whole.tets[t].begin(), whole.tets[t].end(),
                                         [&](std::int32_t n) { return owned.contains(n); });
        EXPECT_TRUE(!touches || local.contains(static_cast<std::int32_t>(t))) << t;
    }
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        for (int i = 0; i < 4; ++i)
            EXPECT_EQ(mesh.nodes[mesh.tets[e][i]], whole.tets[mesh.tet_ids[e]][i]);
}

TEST_P(PartitionedMeshTest, FieldsGoOutAndComeBack) {
    std::vector<Vector3> field;
    for (const Vector3& x : whole.nodes) field.push_back(Vector3(1, 2, 3).cross(x) + 2 * x);
    const PetscHandle<Vec> v = make_vector(mesh);
    test::fill(mesh, field, v.get());
    update_ghosts(v.get());
    {
        const LocalValues values(v.get());
        for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
            for (int c = 0; c < 3; ++c)
                EXPECT_EQ(values.data()[3 * i + c], field[mesh.nodes[i]][c]);
    }
    EXPECT_EQ(test::gather(mesh, v.get()), field);
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    EXPECT_EQ(values_on_first(mesh, local_values(mesh, v.get())),
              rank == 0 ? field : std::vector<Vector3>());
}

/// Of its own mesh a rank finds what the whole mesh has at its own nodes.
TEST_P(PartitionedMeshTest, ThePartOfARankIsAMeshOfItsOwn) {
    EXPECT_EQ(mesh.is_quadratic(), GetParam());
    const TetMesh part = local_mesh(mesh);
    EXPECT_EQ(part.nodes.size(), mesh.nodes.size());
    EXPECT_EQ(part.edge_nodes.size(), whole.edge_nodes.empty() ? 0 : part.tets.size());
    for (std::size_t e = 0; e < part.tets.size(); ++e) {
        EXPECT_EQ(part.regions[e], mesh.tet_ids[e] % 3);
        EXPECT_EQ(part.nodes[part.tets[e][2]], whole.nodes[whole.tets[mesh.tet_ids[e]][2]]);
    }
    std::vector<double> volumes(whole.nodes.size(), 0), own(part.nodes.size(), 0);
    for (const Tet& t : whole.tets)
        for (const std::int32_t n : t) volumes[n] += signed_volume(whole, t);
    for (const Tet& t : part.tets)
        for (const std::int32_t n : t) own[n] += signed_volume(part, t);
    const std::vector<double> local = with_ghosts<double>(mesh, own);
    for (std::size_t i = 0; i < local.size(); ++i)
        EXPECT_NEAR(local[i], volumes[mesh.nodes[i]], 1e-15) << i;
}

INSTANTIATE_TEST_SUITE_P(, PartitionedMeshTest, testing::Bool(),
                         [](const auto& info) { return info.param ? "P2" : "P1"; });

}  // namespace
}  // namespace livetet
