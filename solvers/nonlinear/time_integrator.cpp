#include "solvers/nonlinear/time_integrator.hpp"

#include <atomic>
#include <cmath>
#include <optional>

namespace livetet {

void raise_to(std::atomic<double>& largest, double value) {
    for (double seen = largest.load();
         !(value <= seen) && !std::isnan(seen) && !largest.compare_exchange_weak(seen, value);) {
    }
}

TimeIntegrator::TimeIntegrator(const TimeOptions& time, const LevelAssembler& level,
                               BodyState& state, ThreadTeam& team)
    : time_(time), level_(level), state_(state), team_(team), u0_(level.make_vector()) {
    state.u = level.make_vector();
    if (is_dynamic()) {
        const HeapMeter meter(&cost_);
        for (PetscHandle<Vec>* v : {&state.v, &state.a, &velocity_}) *v = level.make_vector();
        if (time_.scheme == TimeScheme::generalized_alpha) state.end_force = level.make_vector();
    }
    if (level.pressure_space())
        for (PetscHandle<Vec>* p : {&state.p, &p0_}) *p = level.make_pressure_vector();
}

double TimeIntegrator::stiffness_factor() const { return 1 + time_.rayleigh_beta * c_.v_u; }

double TimeIntegrator::mass_factor() const {
    if (!is_dynamic()) return 0;
    return c_.a_u * (1 - c_.alpha_m) / (1 - c_.alpha_f) + time_.rayleigh_alpha * c_.v_u;
}

void TimeIntegrator::begin_step(double dt) {
    c_ = time_coefficients(time_, dt);
    LIVETET_PETSC(VecCopy(state_.u.get(), u0_.get()));
    if (state_.p) LIVETET_PETSC(VecCopy(state_.p.get(), p0_.get()));
}

void TimeIntegrator::return_to_start() {
    LIVETET_PETSC(VecCopy(u0_.get(), state_.u.get()));
    if (state_.p) LIVETET_PETSC(VecCopy(p0_.get(), state_.p.get()));
}

void TimeIntegrator::find_velocity() {
    const ReadArray u(state_.u.get()), u0(u0_.get()), v0(state_.v.get()), a0(state_.a.get());
    WriteArray v1(velocity_.get());
    over_components(team_, level_, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            v1[i] = c_.v_u * (u[i] - u0[i]) + c_.v_v * v0[i] + c_.v_a * a0[i];
    });
}

void TimeIntegrator::add_inertia(Vec force) const {
    const ReadArray u(state_.u.get()), u0(u0_.get()), v0(state_.v.get()), a0(state_.a.get()),
        v1(velocity_.get());
    WriteArray f(force);
    const auto mass = level_.node_mass();
    const double part_m = (1 - c_.alpha_m) / (1 - c_.alpha_f),
                 rest_m = c_.alpha_m / (1 - c_.alpha_f);
    over_components(team_, level_, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const double a1 = c_.a_u * (u[i] - u0[i]) - c_.a_v * v0[i] - c_.a_a * a0[i];
            f[i] += mass[i / 3] * (part_m * a1 + rest_m * a0[i] + time_.rayleigh_alpha * v1[i]);
        }
    });
}

void TimeIntegrator::add_state_inertia(Vec force) const {
    const ReadArray v(state_.v.get()), a(state_.a.get());
    WriteArray f(force);
    const auto mass = level_.node_mass();
    for (std::size_t i = 0; i < f.span().size(); ++i)
        f[i] += mass[i / 3] * (a[i] + time_.rayleigh_alpha * v[i]);
}

void TimeIntegrator::start_acceleration(Vec force, Vec external) {
    const ReadArray f(force), loads(external), v(state_.v.get());
    WriteArray a(state_.a.get());
    const auto mass = level_.node_mass();
    const auto constrained = level_.constrained();
    for (std::size_t i = 0; i < a.span().size(); ++i)
        a[i] = constrained[i / 3] >> (i % 3) & 1
                   ? 0
                   : (loads[i] - f[i]) / mass[i / 3] - time_.rayleigh_alpha * v[i];
    if (state_.end_force) {
        WriteArray h(state_.end_force.get());
        for (std::size_t i = 0; i < h.span().size(); ++i) h[i] = mass[i / 3] * a[i];
    }
    state_.started = true;
}

double TimeIntegrator::finish_step(double dt) {
    update_ghosts(state_.u.get());
    if (!is_dynamic()) return 0;
    const auto constrained = level_.constrained();
    const auto mass = level_.node_mass();
    const ReadArray u(state_.u.get()), u0(u0_.get());
    WriteArray v(state_.v.get()), a(state_.a.get());
    std::optional<WriteArray> end_force;
    if (state_.end_force) end_force.emplace(state_.end_force.get());
    std::atomic<double> largest{0};
    over_components(team_, level_, [&](std::size_t begin, std::size_t end) {
        double error = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const double du = u[i] - u0[i], v0 = v[i], a0 = a[i];
            if (constrained[i / 3] >> (i % 3) & 1) {
                // A prescribed motion has the velocity of its step: the scheme's own would
                // oscillate for ever.
                v[i] = du / dt;
                a[i] = 0;
            } else {
                v[i] = c_.v_u * du + c_.v_v * v0 + c_.v_a * a0;
                a[i] = c_.a_u * du - c_.a_v * v0 - c_.a_a * a0;
            }
            error = std::max(error, std::abs(a[i] - c_.error_from * a0));
            if (end_force)
                (*end_force)[i] = (mass[i / 3] * ((1 - c_.alpha_m) * a[i] + c_.alpha_m * a0) -
                                   c_.alpha_f * (*end_force)[i]) /
                                  (1 - c_.alpha_f);
        }
        raise_to(largest, error);
    });
    double error = c_.error * largest.load();
    if (const PartitionedMesh& mesh = level_.share(); mesh.ranks > 1)
        MPI_Allreduce(MPI_IN_PLACE, &error, 1, MPI_DOUBLE, MPI_MAX, mesh.comm);
    return error;
}

}  // namespace livetet
