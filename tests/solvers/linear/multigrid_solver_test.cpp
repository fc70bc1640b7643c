#include "solvers/linear/multigrid_solver.hpp"

#include <gtest/gtest.h>

#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

/// A beam of cells of two sizes in each of several levels, held at one end and pulled down.
struct Beam {
    Beam(int cells, int levels, CoarseOperator coarse) {
        std::vector<TetMesh> meshes;
        for (int l = 0; l < levels; ++l, cells /= 2)
            meshes.push_back(test::block({2 * cells, cells, cells}, test::beam_size));
        hierarchy = make_hierarchy(std::move(meshes), "a beam");
        for (const TetMesh& level : hierarchy.levels)
            parts.push_back(partition_tets(level.tets, test::rank_count()));
        solver = std::make_unique<MultigridSolver>(
            DistributedHierarchy{PETSC_COMM_WORLD, hierarchy, parts},
            ElasticModel{materials, "linear"},
            SolverOptions{.kind = SolverKind::multigrid, .coarse = coarse},
            DisplacementSolver::Role::solver);
        const TetMesh& mesh = hierarchy.levels.front();
        std::vector<std::uint8_t> held(mesh.nodes.size(), 0);
        std::vector<Vector3> force(mesh.nodes.size(), Vector3(0, 0, -0.1));
        for (const std::int32_t n :
             test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; })) {
            held[n] = 7;
            force[n].setZero();
        }
        solver->set_constrained(local_part<std::uint8_t>(solver->fine().share(), held));
        const PartitionedMesh& share = solver->fine().share();
        for (PetscHandle<Vec>* v : {&u, &b, &x}) *v = make_vector(share);
        LIVETET_PETSC(VecSet(u.get(), 0));
        test::fill(share, force, b.get());
        rotations = solver->fine().make_rotations();
    }
    LinearReport solve() {
        solver->assemble({u.get(), nullptr, &rotations}, {});
        solver->set_up_preconditioner();
        return solver->solve(b.get(), nullptr, x.get(), nullptr, {.relative_tolerance = 1e-8}, {});
    }
    std::vector<Vector3> answer() { return test::gather(solver->fine().share(), x.get()); }

    MeshHierarchy hierarchy;
    std::vector<std::vector<std::int32_t>> parts;
    const std::vector<Material> materials{{.young_Pa = 4000, .poisson = 0.4}};
    std::unique_ptr<MultigridSolver> solver;
    ElementRotations rotations;
    PetscHandle<Vec> u, b, x;
};

TEST(MultigridSolver, IterationsStayWhereTheMeshIsFiner) {
    for (const CoarseOperator coarse : {CoarseOperator::rediscretised, CoarseOperator::galerkin}) {
        const LinearReport small = Beam(4, 2, coarse).solve(), large = Beam(12, 3, coarse).solve();
        EXPECT_TRUE(small.converged && large.converged);
        EXPECT_LE(large.iterations, small.iterations + 3);
        EXPECT_LE(large.iterations, 15);
    }
}

TEST(MultigridSolver, ItsKindOfCoarseOperatorsDoesNotChangeTheAnswer) {
    Beam one(8, 3, CoarseOperator::rediscretised), other(8, 3, CoarseOperator::galerkin);
    EXPECT_TRUE(one.solve().converged);
    EXPECT_TRUE(other.solve().converged);
    const std::vector<Vector3> a = one.answer(), b = other.answer();
    double largest = 0, apart = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        largest = std::max(largest, a[n].norm());
        apart = std::max(apart, (a[n] - b[n]).norm());
    }
    EXPECT_GT(largest, 0);
    EXPECT_LE(apart, 1e-6 * largest);
}

TEST(MultigridSolver, SaysHowItPreconditions) {
    EXPECT_EQ(Beam(4, 2, CoarseOperator::rediscretised).solver->preconditioner_name(),
              "mg, 2 levels, rediscretised, finest matrix-free");
    EXPECT_EQ(Beam(4, 2, CoarseOperator::galerkin).solver->preconditioner_name(),
              "mg, 2 levels, galerkin");
}

}  // namespace
}  // namespace livetet
