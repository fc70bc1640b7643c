#include "solvers/nonlinear/deformable_body.hpp"

#include <algorithm>
#include <thread>

#include "base/stopwatch.hpp"

namespace livetet {

namespace {

/// Only the live solver uses threads; the others use ranks. On a small mesh, threads would wait for
/// each other longer than they work.
int team_size(const SolverOptions& options, std::size_t nodes) {
    constexpr std::size_t nodes_a_thread = 500;
    if (options.kind != SolverKind::live) return 1;
    if (options.threads > 0) return options.threads;
    const std::size_t cores = std::clamp(std::thread::hardware_concurrency(), 1U, 4U);
    return static_cast<int>(std::clamp<std::size_t>(nodes / nodes_a_thread, 1, cores));
}

/// With the mass that a dynamic scheme needs.
TimeIntegrator make_time_integrator(const TimeOptions& time, LinearSolver& solver, BodyState& state,
                                    ThreadTeam& team) {
    if (time.scheme != TimeScheme::static_equilibrium) solver.find_mass();
    return TimeIntegrator(time, solver.fine(), state, team);
}

}  // namespace

DeformableBody::DeformableBody(const DistributedHierarchy& mesh, const ElasticModel& model,
                               const TimeOptions& time, const SolverOptions& options)
    : options_(options),
      team_(team_size(options, mesh.hierarchy.levels.front().nodes.size())),
      solver_(make_linear_solver(mesh, model, options, team_)),
      time_(make_time_integrator(time, *solver_, state_, team_)),
      prescribed_(level()),
      balance_(*solver_, time_, prescribed_, state_, team_),
      newton_(balance_, time_, prescribed_, *solver_, state_, history_, options_),
      stepper_(balance_, time_, prescribed_, *solver_, state_, history_, options_, team_),
      constrained_(mesh.hierarchy.levels.front().nodes.size(), 0) {
    solver_->set_constrained(constrained_);
    prescribed_.find_nodes();
}

void DeformableBody::set_constraints(const Constraints& constraints) {
    if (constraints.components != constrained_) {
        constrained_ = constraints.components;
        solver_->set_constrained(constrained_);
        prescribed_.find_nodes();
        history_.clear();
    }
    prescribed_.set_values(constraints);
}

void DeformableBody::set_displacement(std::span<const Vector3> displacement) {
    fill(mesh(), displacement, state_.u.get());
    if (state_.p) LIVETET_PETSC(VecSet(state_.p.get(), 0));
    state_.started = false;
}

void DeformableBody::set_velocity(std::span<const Vector3> velocity) {
    fill(mesh(), velocity, state_.v.get());
    state_.started = false;
}

void DeformableBody::set_state(const BodySnapshot& snapshot) {
    restore_state(mesh(), snapshot, state_);
    history_.clear();
}

void DeformableBody::keep_state() {
    if (!kept_.u) kept_ = state_.duplicate();
    kept_.copy_from(state_);
}

double DeformableBody::begin_step(double dt, ForceBalance::DampingAt damping) {
    time_.begin_step(dt);
    balance_.begin_step(damping);
    if (time_.is_dynamic() && !state_.started) balance_.start_acceleration();
    return prescribed_.find_increment(state_.u.get());
}

void DeformableBody::end_step(double dt, StepReport& report) {
    linear_solves_.seconds += report.solve_s;
    linear_solves_.times += report.iterations;
    if (report.kept_old) {  // velocity and acceleration are unchanged too
        time_.return_to_start();
        balance_.update_rotations();
        return;
    }
    Stopwatch watch;
    report.time_error = time_.finish_step(dt);
    report.finish_s += watch.lap();
}

StepReport DeformableBody::solve(double dt, const SolveControls& controls) {
    StepReport report;
    Stopwatch watch;
    const bool moves = begin_step(dt, ForceBalance::DampingAt::start) != 0;
    report.forces_s += watch.lap();
    newton_.solve(controls, moves, report);
    if (!balance_.is_finite()) {
        report.converged = false;
        report.kept_old = true;
        report.imbalance = 1;
        history_.clear();
    }
    end_step(dt, report);
    return report;
}

StepReport DeformableBody::advance(double dt, const FrameControls& controls) {
    StepReport report;
    Stopwatch watch;
    const double prescribed_size = begin_step(dt, ForceBalance::DampingAt::present);
    report.forces_s += watch.lap();
    stepper_.advance(prescribed_size, controls, report);
    end_step(dt, report);
    if (!report.kept_old) stepper_.learn(report);
    return report;
}

BodyCosts DeformableBody::costs() const {
    BodyCosts costs{solver_->costs(), time_.cost(), balance_.cost(), linear_solves_};
    costs.rotations.bytes += balance_.rotation_bytes();
    return costs;
}

}  // namespace livetet
