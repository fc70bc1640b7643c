#include "solvers/nonlinear/deformable_body.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "base/sliced_task.hpp"
#include "base/stopwatch.hpp"
#include "solvers/nonlinear/body_input.hpp"

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

/// The options, once all that the body is made from was checked.
const SolverOptions& checked(const ElasticModel& model, const TimeOptions& time,
                             const SolverOptions& options) {
    check_body_input(model, time, options);
    return options;
}

/// With the mass that a dynamic scheme needs.
TimeIntegrator make_time_integrator(const TimeOptions& time, LinearSolver& solver, BodyState& state,
                                    ThreadTeam& team) {
    pause_point();
    if (time.is_dynamic()) solver.find_mass();
    pause_point();
    return TimeIntegrator(time, solver.fine(), state, team);
}

}  // namespace

DeformableBody::DeformableBody(DistributedHierarchy mesh, const ElasticModel& model,
                               const TimeOptions& time, const SolverOptions& options)
    : options_(checked(model, time, options)),
      team_(team_size(options, mesh.levels.front().share.total)),
      solver_(make_linear_solver(std::move(mesh), model, options, team_)),
      time_(make_time_integrator(time, *solver_, state_, team_)),
      prescribed_(level()),
      balance_(*solver_, time_, prescribed_, state_, team_),
      newton_(balance_, time_, prescribed_, *solver_, state_, options_),
      stepper_(balance_, time_, prescribed_, *solver_, state_, options_, team_) {
    solver_->set_constrained(std::vector<std::uint8_t>(this->mesh().nodes.size(), 0));
    prescribed_.find_nodes();
}

void DeformableBody::check_size(std::size_t found, const char* what) const {
    if (found != mesh().nodes.size())
        fail("{}: found {} values, expected {}, one for each node", what, found,
             mesh().nodes.size());
}

void DeformableBody::check_dynamic(const char* what) const {
    if (!time_.is_dynamic())
        fail("{}: a static body has no velocity, expected a dynamic TimeOptions::scheme", what);
}

void DeformableBody::set_constraints(const Constraints& constraints) {
    check_size(constraints.components.size(), "set_constraints: components");
    check_size(constraints.values.size(), "set_constraints: values");
    const auto own = std::span(constraints.components).first(mesh().owned);
    if (on_any_rank(mesh(), !std::ranges::equal(own, level().constrained().first(own.size())))) {
        solver_->set_constrained(own);
        prescribed_.find_nodes();
    }
    prescribed_.set_values(constraints);
}

void DeformableBody::move_constraints(std::span<const std::int32_t> nodes,
                                      std::span<const Vector3> values) {
    if (nodes.size() != values.size())
        fail("move_constraints: found {} values, expected {}, one for each node given",
             values.size(), nodes.size());
    const auto constrained = level().constrained();
    const auto count = std::ssize(constrained);
    for (const std::int32_t n : nodes) {
        if (n < 0 || n >= count)
            fail("move_constraints: found node {}, expected 0 to {}", n, count - 1);
        if (constrained[n] == 0)
            fail("move_constraints: node {} is not constrained: call set_constraints first", n);
    }
    prescribed_.move(nodes, values);
}

void DeformableBody::set_springs(const Springs& springs) {
    if (!springs.empty()) {
        check_size(springs.stiffness.size(), "set_springs: stiffness");
        check_size(springs.target.size(), "set_springs: target");
    }
    balance_.set_springs(springs);
}

void DeformableBody::set_external_force(std::span<const Vector3> force, double share) {
    if (!force.empty()) check_size(force.size(), "set_external_force");
    balance_.set_external_force(force, share);
}

std::vector<Vector3> DeformableBody::velocity() const {
    check_dynamic("velocity");
    return local_values(mesh(), state_.v.get());
}

void DeformableBody::set_displacement(std::span<const Vector3> displacement) {
    check_size(displacement.size(), "set_displacement");
    set_values(mesh(), displacement, state_.u.get());
    balance_.reset_pressures();
    state_.started = false;
}

void DeformableBody::set_velocity(std::span<const Vector3> velocity) {
    check_dynamic("set_velocity");
    check_size(velocity.size(), "set_velocity");
    set_values(mesh(), velocity, state_.v.get());
    state_.started = false;
}

void DeformableBody::set_state(const BodySnapshot& snapshot) {
    restore_state(mesh(), snapshot, state_);
    solver_->forget_solves();
}

void DeformableBody::keep_state() {
    if (!kept_.u) kept_ = state_.duplicate();
    kept_.copy_from(state_);
}

void DeformableBody::begin_step(double dt, ForceBalance::DampingAt damping) {
    if (time_.is_dynamic() && !(dt > 0 && std::isfinite(dt)))
        fail("time step: found {} s, expected more than 0 s in a dynamic body", dt);
    time_.begin_step(dt);
    balance_.begin_step(damping);
    if (time_.is_dynamic() && !state_.started) balance_.start_acceleration();
    prescribed_.find_increment(state_.u.get());
}

void DeformableBody::end_step(double dt, StepReport& report) {
    linear_solves_.seconds += report.solve_s;
    linear_solves_.times += report.iterations;
    if (report.kept_old) {  // velocity and acceleration are unchanged too
        solver_->forget_solves();
        time_.return_to_start();
        balance_.update_rotations();
        return;
    }
    Stopwatch watch;
    report.time_error = time_.finish_step(dt);
    report.finish_s += watch.lap();
}

template <class Work>
StepReport DeformableBody::make_step(double dt, ForceBalance::DampingAt damping, Work&& work) {
    Stopwatch watch;
    begin_step(dt, damping);
    const double begin_s = watch.lap();
    StepReport report;
    if (std::isfinite(prescribed_.increment_size()))
        report = work();
    else
        report.drop("a prescribed displacement is not finite");
    report.forces_s += begin_s;
    end_step(dt, report);
    return report;
}

StepReport DeformableBody::solve(double dt, const SolveControls& controls) {
    return make_step(dt, ForceBalance::DampingAt::start, [&] { return newton_.solve(controls); });
}

StepReport DeformableBody::advance(double dt, const FrameControls& controls) {
    StepReport report =
        make_step(dt, ForceBalance::DampingAt::present, [&] { return stepper_.advance(controls); });
    report.late = controls.deadline && controls.deadline->left_s() < 0;
    if (!report.kept_old) stepper_.learn(report);
    return report;
}

void DeformableBody::linearise() {
    if (time_.is_dynamic())
        fail("linearise: found a dynamic body, expected a static one: TimeOptions::scheme");
    time_.begin_step(0);
    balance_.begin_step(ForceBalance::DampingAt::present);
    balance_.assemble(Tangent::exact);
}

namespace {

/// The columns of `values`, three numbers for each local node, in the rows of this rank's own
/// nodes; zero in constrained components.
PetscHandle<Mat> own_rows(const PartitionedMesh& share, std::span<const std::uint8_t> constrained,
                          const Eigen::MatrixXd& values) {
    PetscHandle<Mat> rows;
    LIVETET_PETSC(MatCreateDense(share.comm, 3 * share.owned, PETSC_DECIDE, PETSC_DETERMINE,
                                 static_cast<PetscInt>(values.cols()), nullptr, rows.out()));
    for (Eigen::Index j = 0; j < values.cols(); ++j) {
        Vec column = nullptr;
        LIVETET_PETSC(MatDenseGetColumnVecWrite(rows.get(), static_cast<PetscInt>(j), &column));
        {
            WriteArray mine(column);
            for (std::int32_t i = 0; i < share.owned; ++i)
                for (int c = 0; c < 3; ++c)
                    mine[3 * i + c] = constrained[static_cast<std::size_t>(i)] >> c & 1
                                          ? 0
                                          : values(3 * i + c, j);
        }
        LIVETET_PETSC(MatDenseRestoreColumnVecWrite(rows.get(), static_cast<PetscInt>(j), &column));
    }
    LIVETET_PETSC(MatAssemblyBegin(rows.get(), MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(rows.get(), MAT_FINAL_ASSEMBLY));
    return rows;
}

/// |b - A x|.
double residual_of(Mat A, Vec x, Vec b) {
    PetscHandle<Vec> r;
    PetscReal norm = 0;
    LIVETET_PETSC(VecDuplicate(b, r.out()));
    LIVETET_PETSC(MatMult(A, x, r.get()));
    LIVETET_PETSC(VecAYPX(r.get(), -1, b));
    LIVETET_PETSC(VecNorm(r.get(), NORM_2, &norm));
    return norm;
}

}  // namespace

LinearReport DeformableBody::responses(const Eigen::MatrixXd& forces, double relative_tolerance,
                                       Eigen::MatrixXd& displacements) {
    check_size(static_cast<std::size_t>(forces.rows() / 3), "responses: forces");
    const PetscHandle<Mat> B = own_rows(mesh(), level().constrained(), forces);
    PetscHandle<Mat> X;
    LIVETET_PETSC(MatDuplicate(B.get(), MAT_DO_NOT_COPY_VALUES, X.out()));
    const bool at_once = forces.cols() > 0 && solver_->apply_factorisation(B.get(), X.get());
    PetscHandle<Vec> b_p, x_p, b = level().make_vector(), x = level().make_vector();
    if (state_.p)
        for (PetscHandle<Vec>* v : {&b_p, &x_p})
            LIVETET_PETSC(VecDuplicate(state_.p.get(), v->out()));
    displacements.resize(forces.rows(), forces.cols());
    std::vector<Vector3> of_nodes;
    LinearReport report{.converged = true, .reason = "no column"};
    for (Eigen::Index j = 0; j < forces.cols() && report.converged; ++j) {
        LIVETET_PETSC(MatGetColumnVector(B.get(), b.get(), static_cast<PetscInt>(j)));
        LIVETET_PETSC(MatGetColumnVector(X.get(), x.get(), static_cast<PetscInt>(j)));
        PetscReal size = 0;
        LIVETET_PETSC(VecNorm(b.get(), NORM_2, &size));
        if (at_once)
            report = {.residual = residual_of(solver_->matrix(), x.get(), b.get()),
                      .converged = true,
                      .reason = "solved by a factorisation"};
        if (!at_once || !(report.residual <= relative_tolerance * size)) {
            if (state_.p)
                for (const PetscHandle<Vec>* v : {&b_p, &x_p}) LIVETET_PETSC(VecSet(v->get(), 0));
            LIVETET_PETSC(VecSet(x.get(), 0));
            report = solver_->solve(b.get(), b_p.get(), x.get(), x_p.get(),
                                    {.relative_tolerance = relative_tolerance});
        }
        local_values(mesh(), x.get(), of_nodes);
        for (std::size_t n = 0; n < of_nodes.size(); ++n)
            displacements.col(j).segment<3>(3 * static_cast<Eigen::Index>(n)) = of_nodes[n];
    }
    return report;
}

std::span<const double> DeformableBody::node_mass() {
    if (level().node_mass().empty()) solver_->find_mass();
    return level().node_mass();
}

BodyCosts DeformableBody::costs() const {
    BodyCosts costs{solver_->costs(), time_.cost(), balance_.cost(), linear_solves_};
    costs.solver.rotations.bytes += balance_.rotation_bytes();
    return costs;
}

}  // namespace livetet
