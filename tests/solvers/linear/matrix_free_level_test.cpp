// The finest level of multigrid without a matrix against the same level with one.

#include "solvers/linear/matrix_free_level.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "mesh/quadratic.hpp"
#include "solvers/linear/multigrid_solver.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

/// Four-node or ten-node tets, and the model's name.
using Elements = std::tuple<bool, const char*>;

/// A beam of two materials, held at one end and bent until some tets are pressed together.
class MatrixFreeLevelTest : public testing::TestWithParam<Elements> {
  protected:
    void SetUp() override {
        hierarchy = make_hierarchy(
            {test::block({8, 4, 4}, test::beam_size), test::block({4, 2, 2}, test::beam_size)},
            "a beam");
        if (std::get<bool>(GetParam())) hierarchy = with_quadratic_level(std::move(hierarchy));
        for (TetMesh& level : hierarchy.levels) {
            level.regions.assign(level.tets.size(), 1);
            for (std::size_t e = 0; e < level.tets.size(); ++e)
                if (level.nodes[level.tets[e][0]].y() < 0.04) level.regions[e] = 2;
        }
        make_solvers();
    }
    void make_solvers() {
        free = make(FinestOperator::automatic);
        assembled = make(FinestOperator::assembled);
        const PartitionedMesh& share = free->fine().share();
        for (PetscHandle<Vec>* v : {&u, &x, &y, &z}) *v = make_vector(share);
        set(u.get(), [](const Vector3& at) {
            return Vector3(-0.4 * at.x(), 2 * at.x() * at.z(), -6 * at.x() * at.x());
        });
        set(x.get(), [](const Vector3& at) {
            return at.x() < 1e-9 ? Vector3(0, 0, 0)
                                 : Vector3(std::sin(40 * at.x()), std::cos(90 * at.y()),
                                           std::sin(50 * at.z() + at.x()));
        });
        rotations = free->fine().make_rotations();
        plain_rotations = assembled->fine().make_rotations();
        bend(1);
    }

    /// So much more than before.
    void bend(double factor) {
        LIVETET_PETSC(VecScale(u.get(), factor));
        update_ghosts(u.get());
        free->update_rotations(u.get(), rotations);
        assembled->update_rotations(u.get(), plain_rotations);
    }

    std::unique_ptr<LinearSolver> make(FinestOperator finest) {
        std::vector<std::vector<std::int32_t>> parts;
        for (const TetMesh& level : hierarchy.levels)
            parts.push_back(partition_tets(level.tets, all_on_first ? 1 : test::rank_count()));
        if (std::get<bool>(GetParam())) parts[0] = parts[1];
        std::unique_ptr<LinearSolver> solver = std::make_unique<MultigridSolver>(
            DistributedHierarchy{PETSC_COMM_WORLD, hierarchy, parts},
            ElasticModel{materials, std::get<const char*>(GetParam())},
            SolverOptions{.kind = SolverKind::multigrid,
                          .coarse = CoarseOperator::rediscretised,
                          .finest = finest},
            DisplacementSolver::Role::solver);
        const PartitionedMesh& share = solver->fine().share();
        std::vector<std::uint8_t> held(share.nodes.size(), 0);
        for (std::size_t n = 0; n < held.size(); ++n)
            if (share.rest[n].x() < 1e-9) held[n] = 7;
        solver->set_constrained(held);
        solver->find_mass();
        return solver;
    }
    /// Solves A y = x without the matrix and A z = x with it; expects the same in at most twice the
    /// iterations.
    void expect_the_same_answer(const char* what) {
        const auto solve = [&](LinearSolver& solver, Vec to) {
            solver.set_up_preconditioner();
            LIVETET_PETSC(VecSet(to, 0));
            const LinearReport report =
                solver.solve(x.get(), nullptr, to, nullptr, {.relative_tolerance = 1e-10}, {});
            EXPECT_TRUE(report.converged) << what << ' ' << report.reason;
            return report.iterations;
        };
        const int iterations = solve(*free, y.get()), plain = solve(*assembled, z.get());
        EXPECT_LE(iterations, 2 * plain) << what << ", with fewer smoothing steps";
        PetscReal size = 0, apart = 0;
        LIVETET_PETSC(VecNorm(z.get(), NORM_2, &size));
        LIVETET_PETSC(VecAXPY(y.get(), -1, z.get()));
        LIVETET_PETSC(VecNorm(y.get(), NORM_2, &apart));
        EXPECT_LE(apart, 1e-8 * size) << what;
    }
    template <class At>
    void set(Vec v, At&& at) {
        const PartitionedMesh& share = free->fine().share();
        std::vector<Vector3> values;
        for (const Vector3& place : share.rest) values.push_back(at(place));
        set_values(share, values, v);
    }
    void assemble(const OperatorTerms& terms) {
        free->assemble({u.get(), nullptr, &rotations}, terms);
        assembled->assemble({u.get(), nullptr, &plain_rotations}, terms);
    }
    void expect_the_same_products(const char* what) {
        LIVETET_PETSC(MatMult(free->matrix(), x.get(), y.get()));
        LIVETET_PETSC(MatMult(assembled->matrix(), x.get(), z.get()));
        PetscReal size = 0, apart = 0;
        LIVETET_PETSC(VecNorm(z.get(), NORM_2, &size));
        LIVETET_PETSC(VecAXPY(y.get(), -1, z.get()));
        LIVETET_PETSC(VecNorm(y.get(), NORM_2, &apart));
        EXPECT_GT(size, 0) << what;
        EXPECT_LE(apart, 1e-12 * size) << what;
    }

    MeshHierarchy hierarchy;
    bool all_on_first = false;  ///< other ranks have nothing
    const std::vector<Material> materials{
        {.young_Pa = 4000, .poisson = 0.4, .density_kg_per_m3 = 1000, .region = 1},
        {.young_Pa = 9000, .poisson = 0.3, .density_kg_per_m3 = 2000, .region = 2}};
    std::unique_ptr<LinearSolver> free, assembled;
    ElementRotations rotations, plain_rotations;
    PetscHandle<Vec> u, x, y, z;
};

TEST_P(MatrixFreeLevelTest, ItsProductIsThatOfTheMatrix) {
    ASSERT_EQ(free->fine().matrix(), nullptr);
    ASSERT_NE(assembled->fine().matrix(), nullptr);
    for (const Tangent tangent : {Tangent::frozen_rotation, Tangent::exact, Tangent::positive}) {
        assemble({.stiffness = 1.3, .tangent = tangent});
        expect_the_same_products("stiffness");
        assemble({.stiffness = 0.7, .mass = 500, .tangent = tangent});
        expect_the_same_products("stiffness and mass");
    }
    for (const auto* solver : {&free, &assembled})
        (*solver)->set_springs(std::vector<double>((*solver)->fine().share().nodes.size(), 3.0));
    assemble({});
    expect_the_same_products("springs");
}

TEST_P(MatrixFreeLevelTest, DampsByTheStiffnessThatWasKept) {
    free->fine().keep_damping({u.get(), nullptr, &rotations});
    assembled->fine().keep_damping({u.get(), nullptr, &plain_rotations});
    bend(-0.5);
    const OperatorTerms terms{.mass = 100, .tangent = Tangent::exact, .damping = 0.4};
    assemble(terms);
    expect_the_same_products("damping");
    // The matrix that it makes in the end has all of it.
    free->fine().make_matrix(MatrixLayout::blocks);
    free->fine().assemble({u.get(), nullptr, &rotations}, terms);
    LIVETET_PETSC(MatMult(free->fine().matrix(), x.get(), y.get()));
    LIVETET_PETSC(VecAXPY(y.get(), -1, z.get()));
    PetscReal size = 0, apart = 0;
    LIVETET_PETSC(VecNorm(z.get(), NORM_2, &size));
    LIVETET_PETSC(VecNorm(y.get(), NORM_2, &apart));
    EXPECT_LE(apart, 1e-12 * size);
}

TEST_P(MatrixFreeLevelTest, ItsCycleIsSymmetricAndPositive) {
    assemble({.tangent = Tangent::exact});
    free->set_up_preconditioner();
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(free->krylov({}), &pc));
    set(y.get(), [](const Vector3& at) {
        return at.x() < 1e-9 ? Vector3(0, 0, 0)
                             : Vector3(std::cos(70 * at.z()), std::sin(30 * at.x()), at.y());
    });
    const PetscHandle<Vec> of_x = make_vector(free->fine().share());
    LIVETET_PETSC(PCApply(pc, x.get(), of_x.get()));
    LIVETET_PETSC(PCApply(pc, y.get(), z.get()));
    PetscScalar xz = 0, yx = 0, xx = 0, yy = 0;
    LIVETET_PETSC(VecDot(x.get(), z.get(), &xz));
    LIVETET_PETSC(VecDot(y.get(), of_x.get(), &yx));
    LIVETET_PETSC(VecDot(x.get(), of_x.get(), &xx));
    LIVETET_PETSC(VecDot(y.get(), z.get(), &yy));
    EXPECT_GT(xx, 0);
    EXPECT_GT(yy, 0);
    EXPECT_NEAR(xz, yx, 1e-4 * std::sqrt(xx * yy));  // in single precision
}

TEST_P(MatrixFreeLevelTest, TheAnswerIsThatOfTheMatrix) {
    bend(0.2);
    assemble({.tangent = Tangent::positive});
    expect_the_same_answer("static");
    assemble({.mass = 1e5, .tangent = Tangent::positive});
    expect_the_same_answer("dynamic");
    for (const auto* solver : {&free, &assembled})
        (*solver)->set_springs(std::vector<double>((*solver)->fine().share().nodes.size(), 1e4));
    assemble({.tangent = Tangent::positive});
    expect_the_same_answer("other springs");
    for (const auto* solver : {&free, &assembled}) {
        const PartitionedMesh& share = (*solver)->fine().share();
        std::vector<std::uint8_t> held(share.nodes.size(), 0);
        for (std::size_t n = 0; n < held.size(); ++n)
            if (share.rest[n].x() < 1e-9) held[n] = share.rest[n].y() < 0.05 ? 7 : 1;
        (*solver)->set_constrained(held);
        (*solver)->set_springs({});
    }
    assemble({.tangent = Tangent::positive});
    expect_the_same_answer("other constraints");
}

TEST_P(MatrixFreeLevelTest, ARankWithoutTetsTakesPart) {
    all_on_first = true;
    make_solvers();
    bend(0.2);
    assemble({.mass = 10, .tangent = Tangent::positive});
    expect_the_same_products("stiffness and mass");
    expect_the_same_answer("stiffness and mass");
    free->fine().keep_damping({u.get(), nullptr, &rotations});
    free->fine().make_matrix(MatrixLayout::scalars);
    EXPECT_NE(free->fine().matrix(), nullptr);
}

TEST_P(MatrixFreeLevelTest, SmoothsHookesStiffnessAtTheBodysRotations) {
    LevelAssembler& level = free->fine();
    MatrixFreeOperator positive(level, ThreadTeam::alone());
    positive.set_constrained();
    ElementRotations rounded;
    level.round_rotations(rotations, rounded);
    constexpr double s = 1.7, m = 300;
    positive.update(rounded, s, m);
    update_ghosts(x.get());
    level.tangent_times(s, Tangent::frozen_rotation, {u.get(), nullptr, &rotations}, x.get(),
                        y.get());
    std::vector<float> in(positive.vector_size(), 0.0F);
    const ReadArray of_x(x.get()), expected(y.get());
    std::copy(of_x.span().begin(), of_x.span().end(), in.begin());
    double largest = 0, apart = 0;
    positive.visit_positive(in, [&](std::size_t i, float Ax) {
        if (positive.free()[i] == 0) return;
        const double with_mass = expected[i] + m * level.node_mass()[i / 3] * of_x[i];
        largest = std::max(largest, std::abs(with_mass));
        apart = std::max(apart, std::abs(Ax - with_mass));
    });
    EXPECT_LE(apart, 1e-5 * largest);
    // Its diagonal is a mean over the components of a node, which rotations do not change.
    for (std::size_t i = 0; i < positive.components(); ++i)
        EXPECT_EQ(positive.inverse_diagonal()[i] > 0, positive.free()[i] != 0) << i;
}

INSTANTIATE_TEST_SUITE_P(, MatrixFreeLevelTest,
                         testing::Combine(testing::Bool(), testing::Values("linear", "corotated")),
                         [](const auto& info) {
                             return std::string(std::get<const char*>(info.param)) +
                                    (std::get<bool>(info.param) ? "P2" : "P1");
                         });

}  // namespace
}  // namespace livetet
