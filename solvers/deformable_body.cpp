#include "solvers/deformable_body.hpp"

#include <chrono>
#include <cmath>

namespace livetet {

namespace {

class Stopwatch {
  public:
    /// Seconds since the last lap.
    double lap() {
        const auto now = std::chrono::steady_clock::now();
        const double seconds = std::chrono::duration<double>(now - last_).count();
        last_ = now;
        return seconds;
    }

  private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

double norm(Vec v) {
    PetscReal n = 0;
    LIVETET_PETSC(VecNorm(v, NORM_2, &n));
    return n;
}

}  // namespace

DeformableBody::DeformableBody(MPI_Comm comm, const MeshHierarchy& hierarchy,
                               std::span<const std::vector<std::int32_t>> parts, std::span<const Material> materials,
                               StrainModel strain, const TimeOptions& time, const SolverOptions& options)
    : time_(time),
      options_(options),
      operator_(comm, hierarchy, parts, materials, strain, options),
      constraints_(hierarchy.levels.front().nodes.size()) {
    for (PetscHandle<Vec>* v : {&u_, &du_, &residual_, &force_, &external_}) *v = vector();
    if (is_dynamic())
        for (PetscHandle<Vec>* v : {&u0_, &v_, &a_, &velocity_}) *v = vector();
    else
        u0_ = vector();
    operator_.set_constrained(constraints_.components);
}

void DeformableBody::set_constraints(const Constraints& constraints) {
    const bool same = constraints.components == constraints_.components;
    constraints_ = constraints;
    if (!same) operator_.set_constrained(constraints_.components);
}

void DeformableBody::set_external_force(std::span<const Vector3> force) {
    fill(operator_.fine().share(), force, external_.get());
}

void DeformableBody::set_velocity(std::span<const Vector3> velocity) {
    fill(operator_.fine().share(), velocity, v_.get());
}

void DeformableBody::take_rotations() {
    update_ghosts(u_.get());
    operator_.update_rotations(u_.get());
}

void DeformableBody::prescribe_values() {
    const MeshShare& share = operator_.fine().share();
    const auto constrained = operator_.fine().constrained();
    WriteArray u(u_.get());
    for (std::int32_t i = 0; i < share.owned; ++i)
        for (int c = 0; c < 3; ++c)
            if (constrained[i] >> c & 1) u[3 * i + c] = constraints_.values[share.nodes[i]][c];
}

double DeformableBody::evaluate_residual(const TimeCoefficients& c) {
    const ElasticLevel& fine = operator_.fine();
    update_ghosts(u_.get());
    fine.elastic_force(u_.get(), force_.get());
    scale_ = norm(force_.get()) + norm(external_.get());
    if (is_dynamic()) {
        // v1 = v_u (u - u0) + v_v v0 + v_a a0
        LIVETET_PETSC(VecWAXPY(velocity_.get(), -1, u0_.get(), u_.get()));
        LIVETET_PETSC(VecScale(velocity_.get(), c.v_u));
        LIVETET_PETSC(VecAXPY(velocity_.get(), c.v_v, v_.get()));
        LIVETET_PETSC(VecAXPY(velocity_.get(), c.v_a, a_.get()));
        if (time_.rayleigh_beta > 0) {
            update_ghosts(velocity_.get());
            fine.add_stiffness_times(time_.rayleigh_beta, velocity_.get(), force_.get());
        }
        const ReadArray u(u_.get()), u0(u0_.get()), v0(v_.get()), a0(a_.get()), v1(velocity_.get());
        WriteArray f(force_.get());
        const auto mass = fine.node_mass();
        for (std::size_t i = 0; i < f.span().size(); ++i) {
            const double a1 = c.a_u * (u[i] - u0[i]) - c.a_v * v0[i] - c.a_a * a0[i];
            f[i] += mass[i / 3] * (a1 + time_.rayleigh_alpha * v1[i]);
        }
    }
    LIVETET_PETSC(VecWAXPY(residual_.get(), -1, force_.get(), external_.get()));
    {
        const auto constrained = fine.constrained();
        WriteArray r(residual_.get());
        for (std::size_t i = 0; i < r.span().size(); ++i)
            if (constrained[i / 3] >> (i % 3) & 1) r[i] = 0;
    }
    return norm(residual_.get());
}

void DeformableBody::start_acceleration() {
    // M a0 = f_ext - f_int(u0) - C v0: with a0 = 0 under loads the scheme would be first order only.
    const ElasticLevel& fine = operator_.fine();
    fine.elastic_force(u_.get(), force_.get());
    if (time_.rayleigh_beta > 0) {
        update_ghosts(v_.get());
        fine.add_stiffness_times(time_.rayleigh_beta, v_.get(), force_.get());
    }
    const ReadArray f(force_.get()), external(external_.get()), v(v_.get());
    WriteArray a(a_.get());
    const auto mass = fine.node_mass();
    const auto constrained = fine.constrained();
    for (std::size_t i = 0; i < a.span().size(); ++i)
        if (!(constrained[i / 3] >> (i % 3) & 1))
            a[i] = (external[i] - f[i]) / mass[i / 3] - time_.rayleigh_alpha * v[i];
    started_ = true;
}

StepReport DeformableBody::step(double dt, const StepEffort& effort) {
    const TimeCoefficients c = time_coefficients(time_, dt);
    const double s = 1 + time_.rayleigh_beta * c.v_u, m = c.a_u + time_.rayleigh_alpha * c.v_u;
    StepReport report;
    Stopwatch watch;
    LIVETET_PETSC(VecCopy(u_.get(), u0_.get()));
    // The first linearisation keeps the rotations of the step's start: with them the forces that moved constraints
    // cause are K_af u_f, not those of a torn layer of elements.
    take_rotations();
    if (is_dynamic() && !started_) start_acceleration();
    operator_.assemble(u_.get(), is_dynamic() ? s : 1, is_dynamic() ? m : 0);
    report.operator_s += watch.lap();
    prescribe_values();
    double imbalance = evaluate_residual(c);
    LIVETET_PETSC(VecSet(du_.get(), 0));
    if (is_dynamic()) {  // the body goes on as it went
        LIVETET_PETSC(VecAXPY(du_.get(), dt, v_.get()));
        const auto constrained = operator_.fine().constrained();
        WriteArray du(du_.get());
        for (std::size_t i = 0; i < du.span().size(); ++i)
            if (constrained[i / 3] >> (i % 3) & 1) du[i] = 0;
    }
    report.forces_s += watch.lap();
    bool kept_old = false;
    for (int k = 0; k < effort.linearisations; ++k) {
        if (k > 0) {
            take_rotations();
            imbalance = evaluate_residual(c);
            report.forces_s += watch.lap();
            if (imbalance <= effort.tolerance * scale_) break;
            operator_.assemble(u_.get(), is_dynamic() ? s : 1, is_dynamic() ? m : 0);
            LIVETET_PETSC(VecSet(du_.get(), 0));
            report.operator_s += watch.lap();
        }
        if (imbalance == 0) break;
        const LinearReport linear = operator_.solve(residual_.get(), du_.get(), effort.linear_tolerance);
        report.converged = report.converged && linear.converged;
        report.iterations += linear.iterations;
        report.linear_residual = linear.residual / imbalance;
        report.solve_s += watch.lap();
        ++report.linearisations;
        if (k == 0)
            LIVETET_PETSC(VecAXPY(u_.get(), 1, du_.get()));
        else
            search_line(c, imbalance);
        report.forces_s += watch.lap();
        if (!is_finite()) {
            LIVETET_PETSC(VecCopy(u0_.get(), u_.get()));
            report.converged = false;
            kept_old = true;
            break;
        }
    }
    if (effort.tolerance > 0 && !kept_old) {  // a live frame does not ask, and does not pay
        take_rotations();
        imbalance = evaluate_residual(c);
    }
    report.imbalance = scale_ > 0 ? imbalance / scale_ : 0;
    if (effort.tolerance > 0) report.converged = report.imbalance <= effort.tolerance && !kept_old;
    finish_step(c, dt);
    return report;
}

double DeformableBody::search_line(const TimeCoefficients& c, double norm_before) {
    double length = 1, taken = 0;
    for (int halvings = 0;; ++halvings) {
        LIVETET_PETSC(VecAXPY(u_.get(), length - taken, du_.get()));
        taken = length;
        take_rotations();
        const double norm_after = evaluate_residual(c);
        if (norm_after <= (1 - 1e-4 * length) * norm_before || halvings == 6) return length;
        length /= 2;
    }
}

void DeformableBody::finish_step(const TimeCoefficients& c, double dt) {
    update_ghosts(u_.get());
    if (!is_dynamic()) return;
    const auto constrained = operator_.fine().constrained();
    const ReadArray u(u_.get()), u0(u0_.get());
    WriteArray v(v_.get()), a(a_.get());
    for (std::size_t i = 0; i < v.span().size(); ++i) {
        const double du = u[i] - u0[i], v0 = v[i], a0 = a[i];
        if (constrained[i / 3] >> (i % 3) & 1) {
            // A prescribed motion has the velocity of its step: the scheme's own would ring on for ever.
            v[i] = du / dt;
            a[i] = 0;
        } else {
            v[i] = c.v_u * du + c.v_v * v0 + c.v_a * a0;
            a[i] = c.a_u * du - c.a_v * v0 - c.a_a * a0;
        }
    }
}

bool DeformableBody::is_finite() const { return std::isfinite(norm(u_.get())); }

std::vector<Vector3> DeformableBody::elastic_force() {
    take_rotations();
    operator_.fine().elastic_force(u_.get(), force_.get());
    return gather(operator_.fine().share(), force_.get());
}

double DeformableBody::strain_energy() {
    take_rotations();
    return operator_.fine().strain_energy(u_.get());
}

double DeformableBody::kinetic_energy() {
    const MeshShare& share = operator_.fine().share();
    const auto mass = operator_.fine().node_mass();
    double energy = 0;
    if (is_dynamic()) {
        const ReadArray v(v_.get());
        for (std::size_t i = 0; i < v.span().size(); ++i) energy += 0.5 * mass[i / 3] * v[i] * v[i];
    }
    MPI_Allreduce(MPI_IN_PLACE, &energy, 1, MPI_DOUBLE, MPI_SUM, share.comm);
    return energy;
}

}  // namespace livetet
