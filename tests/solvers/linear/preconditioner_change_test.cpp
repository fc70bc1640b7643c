// What multigrid is replaced by where its coarse levels do not fit the body.

#include <gtest/gtest.h>

#include <cmath>

#include "solvers/linear/linear_solver.hpp"
#include "solvers/linear/matrix_preconditioner.hpp"
#include "solvers/linear/scalar_copy.hpp"
#include "solvers/linear/stopping_test.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/petsc_options.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

const Vector3 plate_size(0.12, 0.045, 0.01);  // m

/// A strip folded four times in its plane: of a plate of 24 x 9 x 2 cells, every second row, and
/// the cells that join its ends.
TetMesh folded_strip() {
    const std::array<int, 3> cells{24, 9, 2};
    TetMesh plate = test::block(cells, plate_size);
    TetMesh strip;
    std::vector<std::int32_t> number(plate.nodes.size(), -1);
    for (Tet t : plate.tets) {
        Vector3 centre = Vector3::Zero();
        for (const std::int32_t n : t) centre += plate.nodes[n] / 4;
        const int row = static_cast<int>(centre.y() / plate_size.y() * cells[1]);
        const double along = centre.x() / plate_size.x() * cells[0];
        const bool joins = row % 4 == 1 ? along > cells[0] - 1 : along < 1;
        if (row % 2 == 1 && !joins) continue;
        for (std::int32_t& n : t) {
            if (number[n] < 0) {
                number[n] = static_cast<std::int32_t>(strip.nodes.size());
                strip.nodes.push_back(plate.nodes[n]);
            }
            n = number[n];
        }
        strip.tets.push_back(t);
    }
    return strip;
}

/// The strip, or the plate, over coarse levels of the plate: they bridge the strip's gaps.
class PreconditionerChange : public testing::Test {
  protected:
    struct Result {
        LinearReport report;
        std::string name;
        double residual = 0;  ///< true residual, relative
    };

    /// Clamps one end of `finest` and pulls at every node, to 1e-8.
    void make(TetMesh finest, const SolverOptions& options, const char* model = "linear") {
        hierarchy = make_hierarchy({std::move(finest), test::block({12, 4, 1}, plate_size),
                                    test::block({6, 2, 1}, plate_size)},
                                   "a plate");
        const int ranks = test::rank_count();
        parts.clear();
        for (const TetMesh& level : hierarchy.levels)
            parts.push_back(partition_tets(level.tets, ranks));
        solver =
            make_linear_solver({PETSC_COMM_WORLD, hierarchy, parts}, {materials, model}, options);
        const TetMesh& mesh = hierarchy.levels.front();
        std::vector<std::uint8_t> held(mesh.nodes.size(), 0);
        std::vector<Vector3> force(mesh.nodes.size(), Vector3(1e-4, 2e-4, -1e-4));
        for (const std::int32_t n : test::nodes_where(
                 mesh, [](const Vector3& x) { return x.y() < 0.006 && x.x() < 1e-9; })) {
            held[n] = 7;
            force[n] = Vector3::Zero();
        }
        solver->set_constrained(local_part<std::uint8_t>(solver->fine().share(), held));
        b = make_vector(solver->fine().share());
        test::fill(solver->fine().share(), force, b.get());
    }
    Result solve(double tolerance = 1e-8, double bent = 0) {
        const PartitionedMesh& share = solver->fine().share();
        const PetscHandle<Vec> u = make_vector(share), x = make_vector(share),
                               rest = make_vector(share);
        std::vector<Vector3> displacement;
        for (const Vector3& at : share.rest) displacement.push_back({0, 0, bent * at.x() * at.x()});
        set_values(share, displacement, u.get());
        update_ghosts(u.get());
        ElementRotations rotations = solver->fine().make_rotations();
        solver->update_rotations(u.get(), rotations);
        solver->assemble({u.get(), nullptr, &rotations}, {});
        solver->set_up_preconditioner();
        Result result;
        result.report = solver->solve(b.get(), nullptr, x.get(), nullptr,
                                      {.relative_tolerance = tolerance, .max_iterations = 500});
        result.name = solver->name();
        PetscReal size = 0;
        LIVETET_PETSC(MatMult(solver->matrix(), x.get(), rest.get()));
        LIVETET_PETSC(VecAYPX(rest.get(), -1, b.get()));
        LIVETET_PETSC(VecNorm(rest.get(), NORM_2, &result.residual));
        LIVETET_PETSC(VecNorm(b.get(), NORM_2, &size));
        result.residual /= size;
        return result;
    }

    MeshHierarchy hierarchy;
    std::vector<std::vector<std::int32_t>> parts;
    const std::vector<Material> materials{{.young_Pa = 4000, .poisson = 0.4}};
    std::unique_ptr<LinearSolver> solver;
    PetscHandle<Vec> b;
};

TEST_F(PreconditionerChange, LevelsThatDoNotFitAreReplacedInTheFirstSolveAndStayReplaced) {
    if (test::rank_count() > 2) GTEST_SKIP() << "slow; more ranks tell nothing new";
    make(folded_strip(), {.kind = SolverKind::multigrid, .coarse = CoarseOperator::rediscretised});
    EXPECT_GT(solve().report.iterations, 80) << "the levels fit, nothing is tested";
    make(folded_strip(), {});
    const Result first = solve();
    EXPECT_TRUE(first.report.converged) << first.report.reason;
    EXPECT_LE(first.report.iterations, 40);
    EXPECT_LE(first.residual, 2e-8);
    EXPECT_NE(first.name.find("cholesky (MUMPS) in place of mg, 3 levels, rediscretised"),
              std::string::npos)
        << first.name;
    EXPECT_LE(solve().report.iterations, 2);
    // Another operator: springs at every node.
    solver->set_springs(std::vector<double>(solver->fine().share().nodes.size(), 0.1));
    const Result next = solve();
    EXPECT_LE(next.report.iterations, 2);
    EXPECT_LE(next.residual, 2e-8);
    EXPECT_EQ(next.name, first.name);
}

TEST_F(PreconditionerChange, WhatReplacesTheCycleFollowsTheBody) {
    make(folded_strip(), {}, "corotated");
    const Result first = solve();
    EXPECT_NE(first.name.find("cholesky (MUMPS)"), std::string::npos) << first.name;
    for (const double bent : {2.0, 6.0}) {
        const Result next = solve(1e-8, bent);
        EXPECT_LE(next.report.iterations, 2) << bent;
        EXPECT_LE(next.residual, 2e-8) << bent;
    }
}

TEST_F(PreconditionerChange, AMatrixIsKeptWhereOptionsWantOne) {
    const auto has_matrix = [&](const std::string& option, const std::string& value) {
        const std::vector given{std::pair(option, value)};
        const test::PetscOptions options(given);
        make(test::block({12, 4, 1}, plate_size), {.kind = SolverKind::multigrid});
        return solver->fine().matrix() != nullptr;
    };
    EXPECT_TRUE(has_matrix("-pc_type", "jacobi"));
    EXPECT_TRUE(has_matrix("-mg_levels_2_ksp_max_it", "3"));
    EXPECT_TRUE(has_matrix("-mg_levels_ksp_max_it", "3"));
    EXPECT_FALSE(has_matrix("-mg_levels_1_ksp_max_it", "3"));
    EXPECT_FALSE(has_matrix("-ksp_rtol", "1e-9"));
}

TEST_F(PreconditionerChange, LevelsThatFitStay) {
    const TetMesh plate = test::block({24, 8, 2}, plate_size);
    make(plate, {.kind = SolverKind::multigrid, .coarse = CoarseOperator::rediscretised});
    const Result held_to = solve();
    make(plate, {});
    const Result automatic = solve();
    EXPECT_EQ(automatic.report.iterations, held_to.report.iterations);
    EXPECT_EQ(automatic.name, held_to.name);
}

TEST_F(PreconditionerChange, AnExplicitMultigridTakesGalerkinProductsAtMost) {
    if (test::rank_count() > 2) GTEST_SKIP() << "two ranks tell as much";
    make(folded_strip(), {.kind = SolverKind::multigrid});
    const Result result = solve();
    EXPECT_NE(result.name.find("mg, 3 levels, galerkin, finest matrix-free in place of mg, 3 "
                               "levels, rediscretised, finest matrix-free"),
              std::string::npos)
        << result.name;
    make(folded_strip(), {.kind = SolverKind::multigrid, .coarse = CoarseOperator::galerkin});
    EXPECT_EQ(solve().name.find("in place of"), std::string::npos);
}

TEST_F(PreconditionerChange, AnIndefiniteCycleIsReplaced) {
    const test::PetscOptions negative(
        {{"-mg_levels_2_ksp_type", "richardson"}, {"-mg_levels_2_ksp_richardson_scale", "-0.3"}});
    const TetMesh plate = test::block({24, 8, 2}, plate_size);
    make(plate, {.kind = SolverKind::multigrid, .coarse = CoarseOperator::rediscretised});
    EXPECT_FALSE(solve().report.converged) << "the cycle is positive, nothing is tested";
    make(plate, {});
    const Result result = solve();
    EXPECT_TRUE(result.report.converged) << result.report.reason;
    EXPECT_LE(result.residual, 2e-8);
    EXPECT_NE(result.name.find("cholesky"), std::string::npos) << result.name;
}

TEST_F(PreconditionerChange, AggregationSolvesTheFoldedStripIn40Iterations) {
    make(folded_strip(), {.kind = SolverKind::multigrid,
                          .coarse = CoarseOperator::rediscretised,
                          .finest = FinestOperator::assembled});
    (void)solve(0.5);
    solver->fine().set_rigid_motions();
    ScalarCopy scalars;
    Mat A = scalars.update(solver->matrix());
    PetscHandle<KSP> ksp;
    PC pc = nullptr;
    LIVETET_PETSC(KSPCreate(PETSC_COMM_WORLD, ksp.out()));
    LIVETET_PETSC(KSPSetType(ksp.get(), KSPCG));
    LIVETET_PETSC(KSPSetOperators(ksp.get(), A, A));
    LIVETET_PETSC(KSPSetTolerances(ksp.get(), 1e-8, PETSC_DEFAULT, PETSC_DEFAULT, 500));
    LIVETET_PETSC(KSPGetPC(ksp.get(), &pc));
    MatrixPreconditioner aggregation(pc, MatrixMethod::aggregation, "substitute_");
    aggregation.set_matrix(A);
    const PetscHandle<Vec> x = make_vector(solver->fine().share());
    LIVETET_PETSC(KSPSolve(ksp.get(), b.get(), x.get()));
    PetscInt iterations = 0;
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    LIVETET_PETSC(KSPGetIterationNumber(ksp.get(), &iterations));
    LIVETET_PETSC(KSPGetConvergedReason(ksp.get(), &reason));
    EXPECT_GT(reason, 0);
    EXPECT_LE(iterations, 40);
}

TEST_F(PreconditionerChange, AFactorisationIsAffordableByItsOperationsAndMemory) {
    make(folded_strip(), {.kind = SolverKind::multigrid,
                          .coarse = CoarseOperator::rediscretised,
                          .finest = FinestOperator::assembled});
    (void)solve(0.5);
    ScalarCopy scalars;
    Mat A = scalars.update(solver->matrix());
    const FactorisationEstimate strip = estimate_factorisation(A);
    MatInfo info;
    LIVETET_PETSC(MatGetInfo(A, MAT_GLOBAL_SUM, &info));
    EXPECT_GT(strip.operations, info.nz_used);  // an elimination touches each at least once
    EXPECT_GT(strip.bytes, 8 * info.nz_used / 2);
    constexpr auto limit = FactorisationLimit::rather_than_slow_cycles;
    EXPECT_TRUE(is_affordable(A, strip, limit));
    EXPECT_FALSE(is_affordable(A, {1e5 * info.nz_used, strip.bytes}, limit));
    EXPECT_FALSE(is_affordable(A, {strip.operations, 1e15}, limit));
}

TEST(IsTooSlow, ByTheResidualsOfASolveOf40IterationsTo1e8) {
    const auto residual = [](int iterations, int of) {
        return std::pow(1e-8, 1.0 * iterations / of);
    };
    for (int k = 0; k <= 40; ++k) EXPECT_FALSE(is_too_slow(k, residual(k, 40))) << k;
    const auto ends = [&](int of) {
        for (int k = 0; k < of; ++k)
            if (is_too_slow(k, residual(k, of))) return k;
        return of;
    };
    EXPECT_EQ(ends(50), 50);
    EXPECT_LE(ends(80), 21);
    EXPECT_LE(ends(150), 15);
    EXPECT_LE(ends(1000), 11);
    EXPECT_FALSE(is_too_slow(9, 1000)) << "a residual may grow at first";
}

}  // namespace
}  // namespace livetet
