#include "solvers/linear/algebraic_solver.hpp"

#include <gtest/gtest.h>

#include "mesh/hierarchy.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// Name of the solver that `kind` means for a block of one level, once it has a matrix.
std::string solver_of(const std::array<int, 3>& cells, SolverKind kind) {
    const int ranks = test::rank_count();
    const MeshHierarchy hierarchy =
        make_hierarchy({test::block(cells, test::beam_size)}, "a block");
    const std::vector<std::vector<std::int32_t>> parts{
        partition_tets(hierarchy.levels.front().tets, ranks)};
    const std::vector<Material> materials{{.young_Pa = 4000, .poisson = 0.45}};
    const auto solver = make_linear_solver({PETSC_COMM_WORLD, hierarchy, parts},
                                           {materials, "linear"}, {.kind = kind});
    std::vector<std::uint8_t> held(hierarchy.levels.front().nodes.size(), 0);
    held.front() = held[1] = held[2] = 7;
    solver->set_constrained(local_part<std::uint8_t>(solver->fine().share(), held));
    const PetscHandle<Vec> u = make_vector(solver->fine().share());
    LIVETET_PETSC(VecSet(u.get(), 0));
    solver->assemble({.u = u.get()}, {});
    solver->set_up_preconditioner();
    return solver->name();
}

TEST(AlgebraicSolver, AutomaticFactorsWhatIsSmallOrThinAndTakesGamgElsewhere) {
    if (test::rank_count() > 2) GTEST_SKIP() << "slow; more ranks tell nothing new";
    const std::array<int, 3> small{8, 4, 4}, large{20, 16, 16},  // 6069 nodes
        thin{60, 60, 1};                                         // 7442 nodes
    EXPECT_EQ(solver_of(small, SolverKind::automatic), solver_of(small, SolverKind::direct));
    EXPECT_EQ(solver_of(large, SolverKind::automatic), solver_of(large, SolverKind::gamg));
    EXPECT_EQ(solver_of(thin, SolverKind::automatic), solver_of(thin, SolverKind::direct));
    EXPECT_NE(solver_of(large, SolverKind::gamg), solver_of(large, SolverKind::direct));
}

TEST(AlgebraicSolver, AutomaticLeavesTheChoiceToPetscsOptions) {
    LIVETET_PETSC(PetscOptionsSetValue(nullptr, "-pc_type", "bjacobi"));
    const std::string name = solver_of({8, 4, 4}, SolverKind::automatic);
    LIVETET_PETSC(PetscOptionsClearValue(nullptr, "-pc_type"));
    EXPECT_EQ(name, "cg + bjacobi");
}

}  // namespace
}  // namespace livetet
