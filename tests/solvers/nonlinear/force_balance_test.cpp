#include "solvers/nonlinear/force_balance.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "solvers/parallel/sum_over_ranks.hpp"
#include "support/bent_block.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

void expect_known_norms(test::BentBlock&& block) {
    const double at_u = block.balance.evaluate();
    EXPECT_GT(at_u, 0);
    EXPECT_NEAR(at_u, block.norm_of_vectors(), 1e-12 * at_u);
    EXPECT_EQ(at_u, block.balance.residual_norm());
    const double moved = block.balance.subtract_prescribed();
    EXPECT_GT(std::abs(moved - at_u), 1e-3 * at_u);
    EXPECT_NEAR(moved, block.norm_of_vectors(), 1e-12 * moved);
    EXPECT_EQ(moved, block.balance.residual_norm());
}

void expect_known_norms(const MeshHierarchy& hierarchy, SolverKind kind) {
    for (const char* model : {"linear", "corotated", "neohookean"})
        for (const Formulation form : {Formulation::displacement, Formulation::mixed})
            for (const TimeScheme scheme : {TimeScheme::static_equilibrium, TimeScheme::newmark}) {
                SCOPED_TRACE(fmt::format("{}, form {}, scheme {}", model, static_cast<int>(form),
                                         static_cast<int>(scheme)));
                expect_known_norms(test::BentBlock(hierarchy, model, form, scheme, kind));
            }
}

TEST(ForceBalance, KnowsTheNormOfTheResidualThatItWrote) {
    expect_known_norms(
        make_hierarchy({test::block({6, 3, 2}, Vector3(0.06, 0.03, 0.02))}, "a block"),
        SolverKind::automatic);
}

/// Of five tets, so that four ranks do not all have rows.
TEST(ForceBalance, KnowsTheNormWhereRanksHaveNoRows) {
    expect_known_norms(
        make_hierarchy({test::block({1, 1, 1}, Vector3(0.06, 0.03, 0.02))}, "a block"),
        SolverKind::automatic);
}

TEST(ForceBalance, KnowsTheNormOfALiveBody) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    expect_known_norms(make_hierarchy({test::block({12, 6, 4}, Vector3(0.06, 0.03, 0.02)),
                                       test::block({6, 3, 2}, Vector3(0.06, 0.03, 0.02))},
                                      "a block"),
                       SolverKind::live);
}

/// At rest but for the displacement, without loads: r = -f where a component is free, and the scale
/// is the size of f.
TEST(ForceBalance, LeavesPrescribedComponentsOutOfTheResidual) {
    const MeshHierarchy hierarchy =
        make_hierarchy({test::block({6, 3, 2}, Vector3(0.06, 0.03, 0.02))}, "a block");
    test::BentBlock block(hierarchy, "neohookean", Formulation::displacement,
                          TimeScheme::static_equilibrium);
    (void)block.balance.evaluate();
    const double scale = block.balance.scale();
    const std::vector<Vector3> r = local_values(block.solver->fine().share(),
                                                block.balance.residual()),
                               f = block.balance.elastic_force();
    const auto constrained = block.solver->fine().constrained();
    double squares = 0;
    for (std::size_t n = 0; n < r.size(); ++n) {
        if (static_cast<std::int32_t>(n) >= block.solver->fine().share().owned) break;
        EXPECT_LT((r[n] - (constrained[n] ? Vector3(Vector3::Zero()) : Vector3(-f[n]))).norm(),
                  1e-12 * scale);
        squares += f[n].squaredNorm();
    }
    sum_over_ranks(PETSC_COMM_WORLD, {&squares, 1});
    EXPECT_NEAR(std::sqrt(squares), scale, 1e-12 * scale);
}

}  // namespace
}  // namespace livetet
