#include "solvers/linear/distributed_hierarchy.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "base/error.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/refine.hpp"
#include "solvers/linear/transfer.hpp"
#include "solvers/parallel/mesh_distribution.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/partitioners.hpp"
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
            const MeshHierarchy read = make_hierarchy(
                {test::block({6, 3, 3}, test::beam_size), test::block({3, 1, 1}, test::beam_size)},
                "a coarse beam");
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

/// What ranks find from their rows is what one rank finds from the whole mesh.
TEST(DistributedHierarchy, RowsGiveWhatTheWholeMeshGives) {
    if (test::rank_count() == 1) GTEST_SKIP() << "one rank keeps the whole mesh";
    MeshHierarchy whole = beam_levels();
    TetMesh& fine = whole.levels.front();
    fine.node_sets["end"] = test::nodes_where(fine, [](const Vector3& x) { return x.x() < 1e-9; });
    for (const Partitioner partitioner : test::partitioners()) {
        const HierarchyRows rows = rows_of(PETSC_COMM_WORLD, whole);
        const auto parts = partition_levels(PETSC_COMM_WORLD, rows, partitioner);
        const DistributedHierarchy taken(PETSC_COMM_WORLD, rows, parts),
            alone(PETSC_COMM_SELF, whole);
        EXPECT_EQ(taken.tets, alone.tets);
        EXPECT_TRUE(taken.levels[0].share.volumes.empty());
        for (std::size_t l = 0; l < whole.levels.size(); ++l) {
            const PartitionedMesh &share = taken.levels[l].share, &all = alone.levels[l].share;
            for (std::size_t e = 0; e < share.tets.size(); ++e)
                for (int k = 0; k < 4; ++k)
                    EXPECT_EQ(share.nodes[share.tets[e][k]], all.tets[share.tet_ids[e]][k]);
            for (std::size_t i = 0; i < share.nodes.size(); ++i)
                EXPECT_EQ(share.rest[i], whole.levels[l].nodes[share.nodes[i]]);
            if (l == 0) continue;
            ASSERT_EQ(share.volumes.size(), share.tets.size());
            for (std::size_t e = 0; e < share.tets.size(); ++e) {
                const double expected = all.volumes[share.tet_ids[e]];
                EXPECT_NEAR(share.volumes[e], expected, 1e-12 * expected);
            }
        }
        const TransferRows& transfer = taken.between[0].rows;
        const PartitionedMesh &share = taken.levels[0].share, &coarse = taken.levels[1].share;
        ASSERT_EQ(transfer.map().size(), static_cast<std::size_t>(share.owned));
        const std::vector<PetscInt> numbers = petsc_numbers(coarse, test::numbers_to(coarse.total));
        for (std::size_t i = 0; i < transfer.map().size(); ++i)
            for (int k = 0; k < 4; ++k) {
                const auto n = static_cast<std::size_t>(share.nodes[i]);
                EXPECT_EQ(transfer.number(transfer.map().nodes[i][k]),
                          numbers[whole.transfers[0].nodes[n][k]]);
                EXPECT_EQ(transfer.map().weights[i][k], whole.transfers[0].weights[n][k]);
            }
        const LocalNumbers local(share);
        std::vector<std::int32_t> end;
        for (const std::int32_t n : fine.node_sets["end"])
            if (local[n] >= 0) end.push_back(local[n]);
        std::ranges::sort(end);
        EXPECT_EQ(local_sets(rows.rows.levels[0], share).nodes.at("end"), end);
    }
}

TEST(DistributedHierarchy, TheFirstRankGivesEachItsRows) {
    MeshHierarchy whole = with_refined_levels(beam_levels(), 1);
    TetMesh& fine = whole.levels.front();
    fine.node_sets["end"] = test::nodes_where(fine, [](const Vector3& x) { return x.x() < 1e-9; });
    fine.triangle_sets["surface"] = boundary_triangles(fine.tets);
    fine.regions.assign(fine.tets.size(), 3);
    const HierarchyRows expected = rows_of(PETSC_COMM_WORLD, whole);
    const HierarchyRows rows =
        rows_from_first(PETSC_COMM_WORLD, test::rank() == 0 ? whole : MeshHierarchy{});
    ASSERT_EQ(rows.sizes.size(), expected.sizes.size());
    for (std::size_t l = 0; l < rows.sizes.size(); ++l) {
        EXPECT_EQ(rows.sizes[l].nodes, expected.sizes[l].nodes);
        EXPECT_EQ(rows.sizes[l].tets, expected.sizes[l].tets);
        const TetMesh &found = rows.rows.levels[l], &mesh = expected.rows.levels[l];
        EXPECT_EQ(found.nodes, mesh.nodes);
        EXPECT_EQ(found.tets, mesh.tets);
        EXPECT_EQ(found.regions, mesh.regions);
        EXPECT_EQ(found.node_sets, mesh.node_sets);
        EXPECT_EQ(found.triangle_sets, mesh.triangle_sets);
    }
    ASSERT_EQ(rows.rows.transfers.size(), expected.rows.transfers.size());
    for (std::size_t l = 0; l < rows.rows.transfers.size(); ++l) {
        EXPECT_EQ(rows.rows.transfers[l].nodes, expected.rows.transfers[l].nodes);
        EXPECT_EQ(rows.rows.transfers[l].weights, expected.rows.transfers[l].weights);
    }
    EXPECT_EQ(rows.rows.parents, expected.rows.parents);
    EXPECT_EQ(rows.rows.provenance, whole.provenance);
}

TEST(DistributedHierarchy, RowsOfABadMeshAreRefusedOnEveryRank) {
    if (test::rank_count() == 1) GTEST_SKIP() << "one rank checks the whole mesh";
    const auto refusal = [](auto&& damage) -> std::string {
        MeshHierarchy whole = beam_levels();
        HierarchyRows rows = rows_of(PETSC_COMM_WORLD, whole);
        const auto parts = partition_levels(PETSC_COMM_WORLD, rows, Partitioner::metis);
        damage(whole);
        rows = rows_of(PETSC_COMM_WORLD, whole);
        try {
            (void)DistributedHierarchy(PETSC_COMM_WORLD, rows, parts);
        } catch (const Error& error) {
            return error.what();
        }
        return "taken";
    };
    EXPECT_EQ(refusal([](MeshHierarchy&) {}), "taken");
    const auto inverted = refusal([](MeshHierarchy& h) {
        std::swap(h.levels[0].tets.back()[0], h.levels[0].tets.back()[1]);
    });
    EXPECT_NE(inverted.find("mesh hierarchy, level 0: tet 1799 at"), std::string::npos) << inverted;
    EXPECT_NE(inverted.find("is inverted"), std::string::npos) << inverted;
    const auto unused = refusal([](MeshHierarchy& h) { h.levels[0].nodes.emplace_back(1, 1, 1); });
    EXPECT_NE(unused.find("node 468 belongs to no tet"), std::string::npos) << unused;
    const auto set = refusal([](MeshHierarchy& h) { h.levels[0].node_sets["end"] = {5, 9000}; });
    EXPECT_EQ(set, "set end: names node 9000, expected 0 to 467");
}

}  // namespace
}  // namespace livetet
