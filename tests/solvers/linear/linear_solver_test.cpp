// Each linear solver by itself: what it returns solves the assembled system, under the same calls.

#include "solvers/linear/linear_solver.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

struct Kind {
    const char* name;
    SolverKind kind;
    CoarseOperator coarse = CoarseOperator::rediscretised;
    Formulation formulation = Formulation::displacement;
    bool one_rank = false;
};

void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

class LinearSolverTest : public testing::TestWithParam<Kind> {
  protected:
    void SetUp() override {
        const int ranks = test::rank_count();
        if (ranks > 1 && GetParam().one_rank) GTEST_SKIP() << "for one rank";
        for (const TetMesh& level : hierarchy.levels)
            parts.push_back(partition_tets(level.tets, ranks));
        solver = make_linear_solver({PETSC_COMM_WORLD, hierarchy, parts},
                                    {materials, "corotated", GetParam().formulation},
                                    {.kind = GetParam().kind, .coarse = GetParam().coarse});
        const TetMesh& mesh = hierarchy.levels.front();
        std::vector<std::uint8_t> held(mesh.nodes.size(), 0);
        for (const std::int32_t n :
             test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }))
            held[n] = 7;
        solver->set_constrained(local_part<std::uint8_t>(solver->fine().share(), held));
        const PartitionedMesh& share = solver->fine().share();
        u = make_vector(share);
        std::vector<Vector3> bent, force;
        for (const Vector3& x : mesh.nodes) {
            bent.push_back({0, 0, -2 * x.x() * x.x()});
            force.push_back(x.x() < 1e-9 ? Vector3::Zero() : Vector3(0.1, 0, -0.2 - x.y()));
        }
        test::fill(share, bent, u.get());
        update_ghosts(u.get());
        rotations = solver->fine().make_rotations();
        solver->update_rotations(u.get(), rotations);
        b = make_vector(share);
        x = make_vector(share);
        test::fill(share, force, b.get());
        if (!solver->is_mixed()) return;
        const PressureSpace& space = *solver->fine().pressure_space();
        for (PetscHandle<Vec>* v : {&p, &b_p, &x_p}) {
            *v = make_vector(space);
            LIVETET_PETSC(VecSet(v->get(), 0));
        }
    }
    LinearReport assemble_and_solve(const LinearControls& controls,
                                    LinearStart start = LinearStart::zero) {
        solver->assemble({u.get(), p.get(), &rotations}, {});
        solver->set_up_preconditioner();
        return solver->solve(b.get(), b_p.get(), x.get(), x_p.get(), controls, start);
    }

    bool starts_from_earlier() const {
        return !solver->is_mixed() || GetParam().kind == SolverKind::live;
    }

    const MeshHierarchy hierarchy = make_hierarchy(
        {test::block({12, 6, 6}, test::beam_size), test::block({6, 3, 3}, test::beam_size),
         test::block({3, 2, 2}, test::beam_size)},
        "a beam");
    std::vector<std::vector<std::int32_t>> parts;
    const std::vector<Material> materials{{.young_Pa = 4000, .poisson = 0.4}};
    std::unique_ptr<LinearSolver> solver;
    ElementRotations rotations;
    PetscHandle<Vec> u, p, b, b_p, x, x_p;
};

TEST_P(LinearSolverTest, MeetsItsToleranceOnWhatWasAssembled) {
    const LinearReport report = assemble_and_solve({.relative_tolerance = 1e-6});
    EXPECT_TRUE(report.converged) << report.reason;
    PetscReal size = 0;
    LIVETET_PETSC(VecNorm(b.get(), NORM_2, &size));
    EXPECT_LE(report.residual, 1e-6 * size);
    EXPECT_LE(report.iterations, 60);
    EXPECT_FALSE(solver->name().empty());
    if (solver->is_mixed()) return;
    // The true residual, by the operator itself.
    const PetscHandle<Vec> rest = make_vector(solver->fine().share());
    LIVETET_PETSC(MatMult(solver->matrix(), x.get(), rest.get()));
    LIVETET_PETSC(VecAYPX(rest.get(), -1, b.get()));
    PetscReal left = 0;
    LIVETET_PETSC(VecNorm(rest.get(), NORM_2, &left));
    // In single precision the operator's own digits end before.
    EXPECT_LE(left, (GetParam().kind == SolverKind::live ? 1e-3 : 2e-6) * size);
}

TEST_P(LinearSolverTest, TheSameSolveAgainHasNothingLeftToDo) {
    if (!starts_from_earlier()) GTEST_SKIP() << "starts from zero";
    constexpr LinearStart start = LinearStart::earlier_solves;
    const int first = assemble_and_solve({.relative_tolerance = 1e-5}, start).iterations;
    EXPECT_EQ(assemble_and_solve({.relative_tolerance = 1e-5}, start).iterations, first)
        << "it was not kept";
    solver->keep_solve(x.get());
    const LinearReport again = assemble_and_solve({.relative_tolerance = 1e-4}, start);
    EXPECT_TRUE(again.converged);
    EXPECT_LE(again.iterations, 2);
    EXPECT_LT(again.iterations, std::max(2, first));
    solver->forget_solves();
    EXPECT_EQ(assemble_and_solve({.relative_tolerance = 1e-5}, start).iterations, first);
}

TEST_P(LinearSolverTest, SolvesByAnyKrylovMethodStartTheNext) {
    if (solver->is_mixed()) GTEST_SKIP() << "has a method of its own";
    constexpr LinearStart start = LinearStart::earlier_solves;
    for (const KSPType method : {KSPCG, KSPGMRES}) {
        LIVETET_PETSC(KSPSetType(solver->krylov({}), method));
        solver->forget_solves();
        const PetscHandle<Vec> first = make_vector(solver->fine().share());
        LIVETET_PETSC(VecCopy(b.get(), first.get()));
        for (int k = 0; k < 3; ++k) {  // the last two start from others
            (void)assemble_and_solve({.relative_tolerance = 1e-6}, start);
            solver->keep_solve(x.get());
            LIVETET_PETSC(VecPointwiseMult(b.get(), b.get(), first.get()));
        }
        LIVETET_PETSC(VecPointwiseMult(b.get(), first.get(), first.get()));
        LIVETET_PETSC(VecAXPY(b.get(), 1, first.get()));  // a sum of the first two
        const double digits = GetParam().kind == SolverKind::live ? 1e-2 : 1e-4;  // see above
        EXPECT_LE(assemble_and_solve({.relative_tolerance = digits}, start).iterations, 1)
            << method;
        LIVETET_PETSC(VecCopy(first.get(), b.get()));
    }
}

TEST_P(LinearSolverTest, IterationsThatAreNotAllowedCutItShort) {
    if (GetParam().kind == SolverKind::direct) GTEST_SKIP() << "needs no second iteration";
    const LinearReport report =
        assemble_and_solve({.relative_tolerance = 1e-12, .max_iterations = 2});
    EXPECT_FALSE(report.converged);
    EXPECT_TRUE(report.cut_short);
    EXPECT_EQ(report.iterations, 2);
}

INSTANTIATE_TEST_SUITE_P(
    , LinearSolverTest,
    testing::Values(Kind{"multigrid", SolverKind::multigrid},
                    Kind{"galerkin", SolverKind::multigrid, CoarseOperator::galerkin},
                    Kind{"boomeramg", SolverKind::boomeramg}, Kind{"gamg", SolverKind::gamg},
                    Kind{"direct", SolverKind::direct},
                    Kind{"live", SolverKind::live, CoarseOperator::rediscretised,
                         Formulation::displacement, true},
                    Kind{"saddle_point", SolverKind::multigrid, CoarseOperator::rediscretised,
                         Formulation::mixed},
                    Kind{"live_saddle_point", SolverKind::live, CoarseOperator::rediscretised,
                         Formulation::mixed, true},
                    Kind{"saddle_point_boomeramg", SolverKind::boomeramg,
                         CoarseOperator::rediscretised, Formulation::mixed}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(ChooseFormulation, PressuresWhereDisplacementsLockOrInvert) {
    std::vector<Material> materials{{.young_Pa = 4000, .poisson = 0.45}};
    const auto chosen = [&](const ModelChoice& strain, bool graded,
                            Formulation asked = Formulation::automatic) {
        return resolved_formulation({materials, strain, asked, graded});
    };
    EXPECT_EQ(chosen("neohookean", false), Formulation::displacement);
    EXPECT_EQ(chosen("neohookean", true), Formulation::displacement);  // its tangent is bounded
    EXPECT_EQ(chosen("green", true), Formulation::mixed);
    EXPECT_EQ(chosen("corotated", true), Formulation::displacement);
    EXPECT_EQ(chosen("green", true, Formulation::displacement), Formulation::displacement);
    EXPECT_EQ(choose_formulation({materials, "green", Formulation::automatic, true}).reason,
              "a model without bounded tangent on a mesh that is graded at patches");
    materials[0].poisson = 0.49;
    EXPECT_EQ(chosen("corotated", false), Formulation::mixed);
    materials[0].poisson = 0;  // no pressure can stand for lambda = 0
    EXPECT_EQ(chosen("green", true), Formulation::displacement);
}

TEST(MakeLinearSolver, SaysWhatAKindCannotSolve) {
    const std::vector<Material> rubber{{.young_Pa = 4000, .poisson = 0.4}};
    const MeshHierarchy one = make_hierarchy({test::block({3, 2, 2}, test::beam_size)}, "");
    const auto make = [&](SolverKind kind, Formulation formulation, const ModelChoice& strain) {
        return make_linear_solver({PETSC_COMM_SELF, one}, {rubber, strain, formulation},
                                  {.kind = kind});
    };
    EXPECT_THROW(make(SolverKind::multigrid, Formulation::displacement, "corotated"), Error);
    EXPECT_THROW(make(SolverKind::live, Formulation::displacement, "corotated"),
                 Error);  // one level
    EXPECT_THROW(make(SolverKind::live, Formulation::mixed, "corotated"), Error);
    EXPECT_THROW(make(SolverKind::live, Formulation::displacement, "green"), Error);
    EXPECT_EQ(make(SolverKind::gamg, Formulation::displacement, "green")->kind(), SolverKind::gamg);
}

}  // namespace
}  // namespace livetet
