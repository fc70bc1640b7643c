#include "solvers/linear/distributed_hierarchy.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "mesh/quadratic.hpp"
#include "mesh/refine.hpp"
#include "solvers/linear/transfer.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

const std::vector<Material> soft_beam{{.young_Pa = 3000, .poisson = 0.4}};

MeshHierarchy beam_levels() {
    return make_hierarchy(
        {test::block({12, 5, 5}, test::beam_size), test::block({6, 2, 2}, test::beam_size)},
        "a beam");
}

/// Displacement of a beam that is held at one end and pulled down.
std::vector<Vector3> bent(test::WholeBody& body, const TetMesh& mesh) {
    Constraints held(mesh.nodes.size());
    held.prescribe(test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                   Vector3::Zero());
    body.set_constraints(held);
    body.set_external_force(std::vector<Vector3>(mesh.nodes.size(), {0, 0, -1e-4}));
    EXPECT_TRUE(body.solve(0, {.linear_tolerance = 1e-8}).converged);
    return body.displacement();
}

TEST(DistributedHierarchy, ABodyOfSeveralRanksIsMadeWithoutTheWholeMesh) {
    if (test::rank_count() == 1) GTEST_SKIP() << "one rank keeps the whole mesh";
    for (const bool is_quadratic : {false, true})
        for (const Formulation form : {Formulation::displacement, Formulation::mixed}) {
            auto whole = std::make_unique<MeshHierarchy>(beam_levels());
            if (is_quadratic) *whole = with_quadratic_level(std::move(*whole));
            const MeshHierarchy copy = *whole;
            const TetMesh& mesh = copy.levels.front();
            auto parts = partition_levels(PETSC_COMM_WORLD, *whole, Partitioner::metis);
            DistributedHierarchy taken(PETSC_COMM_WORLD, *whole, parts);
            EXPECT_EQ(taken.whole, nullptr);
            whole.reset();
            parts = {};
            const ElasticModel model{soft_beam, "corotated", form};
            const SolverOptions options{.kind = SolverKind::multigrid};
            test::WholeBody body(std::move(taken), model, TimeOptions{}, options);
            test::WholeBody alone(DistributedHierarchy{PETSC_COMM_SELF, copy}, model, TimeOptions{},
                                  options);
            const std::vector<Vector3> found = bent(body, mesh), expected = bent(alone, mesh);
            double largest = 0;
            for (const Vector3& u : expected) largest = std::max(largest, u.norm());
            EXPECT_GT(largest, 1e-3);
            for (std::size_t n = 0; n < found.size(); ++n)
                EXPECT_LT((found[n] - expected[n]).norm(), 1e-6 * largest) << n;
        }
}

/// Levels that ranks cut from their own parts against those that one rank cuts from the whole mesh.
TEST(DistributedHierarchy, RanksRefineTheirPartsToTheSameBody) {
    if (test::rank_count() == 1) GTEST_SKIP() << "one rank refines the whole mesh";
    for (const bool is_quadratic : {false, true})
        for (const Formulation form : {Formulation::displacement, Formulation::mixed}) {
            const MeshHierarchy read = beam_levels();
            MeshHierarchy whole = with_refined_levels(read, 1);
            if (is_quadratic) whole = with_quadratic_level(std::move(whole));
            DistributedHierarchy taken(
                PETSC_COMM_WORLD, read,
                partition_levels(PETSC_COMM_WORLD, read, Partitioner::metis));
            taken.add_refined();
            if (is_quadratic) taken.add_quadratic();
            EXPECT_EQ(taken.tets, whole.levels.front().tets.size());
            ASSERT_EQ(taken.levels.size(), whole.levels.size());
            const ElasticModel model{soft_beam, "corotated", form};
            const SolverOptions options{.kind = SolverKind::multigrid};
            test::WholeBody body(std::move(taken), model, TimeOptions{}, options);
            test::WholeBody alone(DistributedHierarchy{PETSC_COMM_SELF, whole}, model,
                                  TimeOptions{}, options);
            const TetMesh& mesh = whole.levels.front();
            const std::vector<Vector3> found = bent(body, mesh), expected = bent(alone, mesh);
            double largest = 0;
            for (const Vector3& u : expected) largest = std::max(largest, u.norm());
            EXPECT_GT(largest, 1e-3);
            for (std::size_t n = 0; n < found.size(); ++n)
                EXPECT_LT((found[n] - expected[n]).norm(), 1e-6 * largest) << n;
        }
}

TEST(DistributedHierarchy, CoarseTetsHoldTheVolumesThatTheyStandFor) {
    const MeshHierarchy whole = beam_levels();
    const auto parts = partition_levels(PETSC_COMM_WORLD, whole, Partitioner::metis);
    const DistributedHierarchy taken(PETSC_COMM_WORLD, whole, parts);
    EXPECT_TRUE(taken.levels[0].share.volumes.empty());
    const auto carried =
        carried_volumes(nodal_volumes(whole.levels[0]), whole.transfers[0], whole.levels[1]);
    const PartitionedMesh& share = taken.levels[1].share;
    ASSERT_EQ(share.volumes.size(), share.tets.size());
    for (std::size_t e = 0; e < share.tets.size(); ++e)
        EXPECT_EQ(share.volumes[e], carried[share.tet_ids[e]]);
}

}  // namespace
}  // namespace livetet
