#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "solvers/nonlinear/force_balance.hpp"
#include "solvers/parallel/partition.hpp"

namespace livetet::test {

/// A balance of forces with what it needs around it, on all ranks, of a block or a grid whose nodes
/// are at uneven displacements; those at x = 0 are prescribed, and are to move.
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

}  // namespace livetet::test
