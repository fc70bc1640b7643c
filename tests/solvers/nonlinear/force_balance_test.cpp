#include "solvers/nonlinear/force_balance.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "solvers/parallel/partition.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A balance of forces with what it needs around it, on all ranks, of a block whose nodes are at
/// uneven displacements; those at x = 0 are prescribed, and are to move.
struct BentBlock {
    BentBlock(const MeshHierarchy& hierarchy, const char* model, Formulation form,
              TimeScheme scheme, SolverKind kind = SolverKind::automatic)
        : time_options{.scheme = scheme, .rayleigh_beta = 0.01},
          solver(make_linear_solver(
              DistributedHierarchy(
                  PETSC_COMM_WORLD, hierarchy,
                  partition_levels(PETSC_COMM_WORLD, hierarchy, Partitioner::metis)),
              {materials, model, form}, {.kind = kind}, team)),
          time((time_options.is_dynamic() ? solver->find_mass() : void(), time_options),
               solver->fine(), state, team),
          prescribed(solver->fine()),
          balance(*solver, time, prescribed, state, team) {
        const PartitionedMesh& share = solver->fine().share();
        Constraints constraints(share.nodes.size());
        for (std::size_t n = 0; n < share.nodes.size(); ++n)
            if (share.rest[n].x() < 1e-9) {
                constraints.components[n] = 7;
                constraints.values[n] = {0.002, 0.001, -0.001};
            }
        solver->set_constrained(std::span(constraints.components).first(share.owned));
        prescribed.find_nodes();
        prescribed.set_values(constraints);
        {
            WriteArray u(state.u.get());
            for (std::size_t i = 0; i < u.span().size(); ++i)
                u[i] =
                    5e-4 * std::sin(3 + static_cast<double>(i % 3) + 200 * share.rest[i / 3].sum());
        }
        balance.reset_pressures();
        time.begin_step(0.01);
        balance.begin_step(ForceBalance::DampingAt::start);
        prescribed.find_increment(state.u.get());
    }
    double norm_of_vectors() const {
        return balance.volume_residual()
                   ? std::hypot(norm_of(balance.residual()), norm_of(balance.volume_residual()))
                   : norm_of(balance.residual());
    }

    const std::vector<Material> materials{
        {.young_Pa = 3000, .poisson = 0.4, .density_kg_per_m3 = 1000}};
    ThreadTeam team{2};
    TimeOptions time_options;
    std::unique_ptr<LinearSolver> solver;
    BodyState state;
    TimeIntegrator time;
    PrescribedMotion prescribed;
    ForceBalance balance;
};

void expect_known_norms(BentBlock&& block) {
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
                expect_known_norms(BentBlock(hierarchy, model, form, scheme, kind));
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
    BentBlock block(hierarchy, "neohookean", Formulation::displacement,
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
