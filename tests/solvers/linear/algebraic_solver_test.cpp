#include "solvers/linear/algebraic_solver.hpp"

#include <gtest/gtest.h>

#include "mesh/hierarchy.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// Name of the solver that `kind` means for a block of one level.
std::string solver_of(const std::array<int, 3>& cells, SolverKind kind) {
    int ranks = 1;
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    const MeshHierarchy hierarchy =
        make_hierarchy({test::block(cells, test::beam_size)}, "a block");
    const std::vector<std::vector<std::int32_t>> parts{
        partition_tets(hierarchy.levels.front().tets, ranks)};
    const std::vector<Material> materials{{.young_Pa = 4000, .poisson = 0.45}};
    return make_linear_solver({PETSC_COMM_WORLD, hierarchy, parts}, {materials, "linear"},
                              {.kind = kind})
        ->name();
}

TEST(AlgebraicSolver, AutomaticFactorsASmallMeshOfOneLevelAndTakesGamgBeyond) {
    EXPECT_EQ(solver_of({8, 4, 4}, SolverKind::automatic),
              solver_of({8, 4, 4}, SolverKind::direct));
    const std::array<int, 3> large{20, 16, 16};  // 6069 nodes
    EXPECT_EQ(solver_of(large, SolverKind::automatic), solver_of(large, SolverKind::gamg));
    EXPECT_NE(solver_of(large, SolverKind::gamg), solver_of(large, SolverKind::direct));
}

}  // namespace
}  // namespace livetet
