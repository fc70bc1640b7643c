#include "solvers/nonlinear/deformable_body.hpp"

#include <Eigen/Geometry>

#include <atomic>
#include <cmath>
#include <optional>
#include <thread>

#include "base/stopwatch.hpp"

namespace livetet {

namespace {

/// The weight of the newest in the running means of how long things take.
constexpr double lately = 0.2;

/// The time of a whole renewal over that of a half, which has the coarse levels and the shared
/// tets, too.
constexpr double whole_over_half = 1.6;

/// Constraints that go so much farther than they usually do in a step have jumped; so many steps
/// after it take operators whole, since halves would let a large change of the rotations ring.
constexpr double sudden = 4;
constexpr int steps_to_settle = 10;
/// Half an operator leads astray where a node would go this many times as far as what is driven. In
/// 480 frames of a press at 369,000 tets, one iteration each, eleven went more than 4 times as far,
/// four more than 9, and two, where tets had flipped, 27 and 147 times.
constexpr double astray = 8;
/// Of forces that are so much smaller than round-off nothing comes, however far moduli are apart.
constexpr double far_below_round_off = 1e-12;
/// How many times its own size a body may be away from its rest: beyond, its state is lost.
constexpr double farthest = 100;

/// largest = max(largest, value), from any thread; what is not a number stays.
void raise_to(std::atomic<double>& largest, double value) {
    for (double seen = largest.load();
         !(value <= seen) && !std::isnan(seen) && !largest.compare_exchange_weak(seen, value);) {
    }
}

double norm(Vec v) {
    PetscReal n = 0;
    LIVETET_PETSC(VecNorm(v, NORM_2, &n));
    return n;
}

/// Threads beyond the caller's serve the live solver alone: the others have ranks. On a small mesh
/// they would wait for each other longer than they work, and on a busy machine for their turns.
int team_size(const SolverOptions& options, std::size_t nodes) {
    constexpr std::size_t worth_a_thread = 500;  // nodes
    if (options.kind != SolverKind::live) return 1;
    if (options.threads > 0) return options.threads;
    const std::size_t cores = std::clamp(std::thread::hardware_concurrency(), 1U, 4U);
    return static_cast<int>(std::clamp<std::size_t>(nodes / worth_a_thread, 1, cores));
}

}  // namespace

DeformableBody::DeformableBody(MPI_Comm comm, const MeshHierarchy& hierarchy,
                               std::span<const std::vector<std::int32_t>> parts,
                               const ElasticModel& model, const TimeOptions& time,
                               const SolverOptions& options)
    : time_(time),
      options_(options),
      team_(team_size(options, hierarchy.levels.front().nodes.size())),
      operator_(comm, hierarchy, parts, model, options, team_),
      constrained_(hierarchy.levels.front().nodes.size(), 0) {
    for (PetscHandle<Vec>* v : {&u_, &u0_, &du_, &residual_, &force_, &external_, &prescribed_})
        *v = vector();
    if (operator_.fine().holds_rotations()) at_ = vector();
    if (is_dynamic()) {
        operator_.find_mass();
        const HeapGrowth grown(&velocities_);
        for (PetscHandle<Vec>* v : {&v_, &a_, &velocity_}) *v = vector();
        if (time_.scheme == TimeScheme::generalized_alpha) net_ = vector();
    }
    if (operator_.is_mixed())
        for (PetscHandle<Vec>* v : {&p_, &p0_, &dp_, &volume_})
            *v = make_vector(*operator_.fine().pressure_space());
    operator_.set_constrained(constrained_);
    find_held();
    Eigen::AlignedBox3d box;
    for (const Vector3& x : hierarchy.levels.front().nodes) box.extend(x);
    farthest_ = farthest * box.diagonal().norm() *
                std::sqrt(static_cast<double>(hierarchy.levels.front().nodes.size()));
    // Stresses are made of F = I + grad u: no force is better than the moduli's last digit.
    round_off_ = operator_.fine().force_epsilon() * operator_.fine().force_at_unit_strain();
}

void DeformableBody::set_constraints(const Constraints& constraints) {
    if (constraints.components != constrained_) {
        constrained_ = constraints.components;
        operator_.set_constrained(constrained_);
        find_held();
    }
    const PartitionedMesh& share = operator_.fine().share();
    for (std::size_t k = 0; k < held_nodes_.size(); ++k)
        held_values_[k] = constraints.values[share.nodes[held_nodes_[k]]];
}

void DeformableBody::find_held() {
    const PartitionedMesh& share = operator_.fine().share();
    held_nodes_.clear();
    held_at_.assign(share.owned, -1);
    for (std::int32_t i = 0; i < share.owned; ++i) {
        if (!operator_.fine().constrained()[i]) continue;
        held_at_[i] = static_cast<std::int32_t>(held_nodes_.size());
        held_nodes_.push_back(i);
    }
    held_values_.assign(held_nodes_.size(), Vector3::Zero());
    LIVETET_PETSC(VecSet(prescribed_.get(), 0));
    guesses_ = 0;
}

void DeformableBody::move_constraints(std::span<const std::int32_t> nodes,
                                      std::span<const Vector3> values) {
    const PartitionedMesh& share = operator_.fine().share();
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        const PetscInt i =
            share.number_of_node[nodes[k]] - (share.owned > 0 ? share.numbers.front() : 0);
        if (i >= 0 && i < share.owned && held_at_[i] >= 0) held_values_[held_at_[i]] = values[k];
    }
}

void DeformableBody::set_springs(const Springs& springs) {
    const bool same = springs.stiffness == springs_.stiffness;
    springs_ = springs;
    if (!same) operator_.set_springs(springs_.stiffness);
}

void DeformableBody::set_external_force(std::span<const Vector3> force, double share) {
    if (force.empty())
        LIVETET_PETSC(VecSet(external_.get(), 0));
    else
        fill(operator_.fine().share(), force, external_.get());
    if (share != 1) LIVETET_PETSC(VecScale(external_.get(), share));
    external_size_ = norm(external_.get());
}

void DeformableBody::set_displacement(std::span<const Vector3> displacement) {
    fill(operator_.fine().share(), displacement, u_.get());
    if (p_) LIVETET_PETSC(VecSet(p_.get(), 0));
    started_ = false;
}

void DeformableBody::set_velocity(std::span<const Vector3> velocity) {
    fill(operator_.fine().share(), velocity, v_.get());
    started_ = false;
}

BodyCosts DeformableBody::costs() const {
    return {operator_.costs(), velocities_, forces_, linear_solves_};
}

std::vector<Vec> DeformableBody::state_vectors() const {
    std::vector<Vec> vectors{u_.get()};
    for (const PetscHandle<Vec>* v : {&v_, &a_, &net_, &p_})
        if (*v) vectors.push_back(v->get());
    return vectors;
}

void DeformableBody::copy_state(const DeformableBody& other) {
    const std::vector<Vec> mine = state_vectors(), theirs = other.state_vectors();
    for (std::size_t i = 0; i < mine.size(); ++i) LIVETET_PETSC(VecCopy(theirs[i], mine[i]));
    started_ = other.started_;
}

BodySnapshot DeformableBody::gather_state() const {
    const PartitionedMesh& share = operator_.fine().share();
    BodySnapshot state;
    for (const PetscHandle<Vec>* v : {&u_, &v_, &a_, &net_})
        if (*v) state.nodal.push_back(gather(share, v->get()));
    if (p_) {
        const ReadArray mine(p_.get());
        PetscInt corners = 0;
        LIVETET_PETSC(VecGetSize(p_.get(), &corners));
        state.pressure.assign(static_cast<std::size_t>(corners), 0);
        for (std::size_t i = 0; i < mine.span().size(); ++i)
            state.pressure[share.nodes[i]] = mine[i];
        if (share.ranks > 1)
            MPI_Allreduce(MPI_IN_PLACE, state.pressure.data(), static_cast<int>(corners),
                          MPI_DOUBLE, MPI_SUM, share.comm);
    }
    state.started = started_;
    return state;
}

void DeformableBody::set_state(const BodySnapshot& state) {
    const PartitionedMesh& share = operator_.fine().share();
    std::size_t k = 0;
    for (const PetscHandle<Vec>* v : {&u_, &v_, &a_, &net_}) {
        if (!*v) continue;
        if (k >= state.nodal.size() || state.nodal[k].size() != share.number_of_node.size())
            fail("the state of a body has {} fields, {} nodes in number {}, expected {} nodes",
                 state.nodal.size(), k < state.nodal.size() ? state.nodal[k].size() : 0, k,
                 share.number_of_node.size());
        fill(share, state.nodal[k++], v->get());
    }
    if (p_) {
        WriteArray mine(p_.get());
        PetscInt corners = 0;
        LIVETET_PETSC(VecGetSize(p_.get(), &corners));
        if (state.pressure.size() != static_cast<std::size_t>(corners))
            fail("the state of a body has {} pressures, expected {}", state.pressure.size(),
                 corners);
        for (std::size_t i = 0; i < mine.span().size(); ++i)
            mine[i] = state.pressure[share.nodes[i]];
    }
    started_ = state.started;
    guesses_ = 0;
}

void DeformableBody::keep_state() {
    const std::vector<Vec> now = state_vectors();
    kept_.resize(now.size());
    for (std::size_t i = 0; i < now.size(); ++i) {
        if (!kept_[i]) LIVETET_PETSC(VecDuplicate(now[i], kept_[i].out()));
        LIVETET_PETSC(VecCopy(now[i], kept_[i].get()));
    }
    kept_started_ = started_;
}

void DeformableBody::return_to_kept_state() {
    const std::vector<Vec> now = state_vectors();
    for (std::size_t i = 0; i < kept_.size(); ++i) LIVETET_PETSC(VecCopy(kept_[i].get(), now[i]));
    started_ = kept_started_;
}

void DeformableBody::take_rotations() {
    update_ghosts(u_.get());
    if (p_) update_ghosts(p_.get());
    operator_.update_rotations(u_.get());
}

double DeformableBody::find_prescribed() {
    const PartitionedMesh& share = operator_.fine().share();
    const auto constrained = operator_.fine().constrained();
    double largest = 0;
    {
        const ReadArray u(u_.get());
        WriteArray way(prescribed_.get());
        for (std::size_t k = 0; k < held_nodes_.size(); ++k)
            for (int c = 0; c < 3; ++c) {
                const std::int32_t i = held_nodes_[k];
                if (constrained[i] >> c & 1) way[3 * i + c] = held_values_[k][c] - u[3 * i + c];
                if (const double d = std::abs(way[3 * i + c]);
                    !(d <= largest) && !std::isnan(largest))
                    largest = d;
            }
    }
    if (share.ranks > 1) MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, share.comm);
    return largest;
}

void DeformableBody::zero_constrained(Vec v) const {
    const auto constrained = operator_.fine().constrained();
    WriteArray values(v);
    for (std::size_t i = 0; i < values.span().size(); ++i)
        if (constrained[i / 3] >> (i % 3) & 1) values[i] = 0;
}

double DeformableBody::residual_norm() const {
    return volume_ ? std::hypot(norm(residual_.get()), norm(volume_.get())) : norm(residual_.get());
}

double DeformableBody::evaluate_residual(const TimeCoefficients& c, bool prescribed) {
    const PhaseTimer timer(forces_);
    const LevelAssembler& fine = operator_.fine();
    const double beta = time_.rayleigh_beta;
    if (is_dynamic()) {
        // v1 = v_u (u - u0) + v_v v0 + v_a a0
        const ReadArray u(u_.get()), u0(u0_.get()), v0(v_.get()), a0(a_.get());
        WriteArray v1(velocity_.get());
        over_components([&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                v1[i] = c.v_u * (u[i] - u0[i]) + c.v_v * v0[i] + c.v_a * a0[i];
        });
    }
    if (fine.holds_rotations()) {
        // With the rotations held forces are affine: f(u) + beta K v1 + (1 + beta v_u) K w is the
        // force at one place.
        Vec at = u_.get();
        if (prescribed || (is_dynamic() && beta > 0)) {
            at = at_.get();
            const double of_w = prescribed ? 1 + beta * c.v_u : 0;
            const ReadArray u(u_.get()), w(prescribed_.get()),
                v1(is_dynamic() ? velocity_.get() : u_.get());
            const double of_v = is_dynamic() ? beta : 0;
            WriteArray y(at);
            over_components([&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) y[i] = u[i] + of_w * w[i] + of_v * v1[i];
            });
        }
        if (at != u_.get()) update_ghosts(at);
        fine.held_force(at, force_.get());
    } else {
        fine.elastic_force(state(), force_.get());
        if (is_dynamic() && beta > 0) {
            update_ghosts(velocity_.get());
            fine.add_stiffness_times(beta, state(), velocity_.get(), force_.get());
        }
    }
    subtract_spring_pull();
    scale_ = std::max(start_scale_, norm(force_.get()) + external_size_);
    if (is_dynamic()) add_inertia(c);
    {
        const auto constrained = fine.constrained();
        const ReadArray f(force_.get()), external(external_.get()),
            net(net_ ? net_.get() : external_.get());
        const double of_net = net_ ? c.alpha_f / (1 - c.alpha_f) : 0;
        WriteArray r(residual_.get());
        over_components([&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                r[i] = constrained[i / 3] >> (i % 3) & 1 ? 0 : external[i] - f[i] + of_net * net[i];
        });
    }
    if (volume_) operator_.coupling().residual(u_.get(), p_.get(), volume_.get());
    return residual_norm();
}

void DeformableBody::add_inertia(const TimeCoefficients& c) {
    const ReadArray u(u_.get()), u0(u0_.get()), v0(v_.get()), a0(a_.get()), v1(velocity_.get());
    WriteArray f(force_.get());
    const auto mass = operator_.fine().node_mass();
    const double part_m = (1 - c.alpha_m) / (1 - c.alpha_f), rest_m = c.alpha_m / (1 - c.alpha_f);
    over_components([&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const double a1 = c.a_u * (u[i] - u0[i]) - c.a_v * v0[i] - c.a_a * a0[i];
            f[i] += mass[i / 3] * (part_m * a1 + rest_m * a0[i] + time_.rayleigh_alpha * v1[i]);
        }
    });
}

void DeformableBody::subtract_spring_pull() {
    const LevelAssembler& fine = operator_.fine();
    const auto springs = fine.springs();
    if (springs.empty()) return;
    const ReadArray u(u_.get());
    WriteArray f(force_.get());
    for (std::size_t i = 0; i < f.span().size(); ++i)
        if (springs[i / 3] > 0)
            f[i] -= springs[i / 3] * (springs_.target[fine.share().nodes[i / 3]][i % 3] - u[i]);
}

double DeformableBody::subtract_prescribed(const TimeCoefficients& c) {
    // residual(u + w) is about residual(u) - A w: with the forces at u no layer of elements is
    // torn.
    update_ghosts(prescribed_.get());
    LIVETET_PETSC(VecSet(force_.get(), 0));
    operator_.fine().add_stiffness_times(1 + time_.rayleigh_beta * c.v_u, state(),
                                         prescribed_.get(), force_.get());
    zero_constrained(force_.get());
    LIVETET_PETSC(VecAXPY(residual_.get(), -1, force_.get()));
    if (volume_)
        operator_.coupling().add_residual_increment(u_.get(), prescribed_.get(), volume_.get());
    scale_ = std::max(scale_, norm(force_.get()));
    return residual_norm();
}

void DeformableBody::start_acceleration() {
    // M a0 = f_ext - f_int(u0) - C v0: with a0 = 0 under loads the scheme would be first order
    // only.
    const LevelAssembler& fine = operator_.fine();
    fine.elastic_force(state(), force_.get());
    subtract_spring_pull();
    if (time_.rayleigh_beta > 0) {
        update_ghosts(v_.get());
        fine.add_stiffness_times(time_.rayleigh_beta, state(), v_.get(), force_.get());
    }
    const ReadArray f(force_.get()), external(external_.get()), v(v_.get());
    WriteArray a(a_.get());
    const auto mass = fine.node_mass();
    const auto constrained = fine.constrained();
    for (std::size_t i = 0; i < a.span().size(); ++i)
        a[i] = constrained[i / 3] >> (i % 3) & 1
                   ? 0
                   : (external[i] - f[i]) / mass[i / 3] - time_.rayleigh_alpha * v[i];
    if (net_) {
        WriteArray h(net_.get());
        for (std::size_t i = 0; i < h.span().size(); ++i) h[i] = mass[i / 3] * a[i];
    }
    started_ = true;
}

bool DeformableBody::assemble(const TimeCoefficients& c, Tangent tangent, bool by_halves) {
    if (!is_dynamic()) return operator_.assemble(state(), 1, 0, tangent, by_halves);
    return operator_.assemble(
        state(), 1 + time_.rayleigh_beta * c.v_u,
        c.a_u * (1 - c.alpha_m) / (1 - c.alpha_f) + time_.rayleigh_alpha * c.v_u, tangent,
        by_halves);
}

bool DeformableBody::is_late(const StepControls& effort) const {
    return effort.deadline &&
           Clock::now() + std::chrono::duration<double>(renewal_s_ + rest_s_) > *effort.deadline;
}

LinearReport DeformableBody::solve_linear(const TimeCoefficients& c, const StepControls& effort,
                                          StepReport& report) {
    Stopwatch watch;
    const bool exact = options_.tangent == TangentChoice::exact ||
                       (options_.tangent == TangentChoice::automatic && effort.tolerance > 0);
    Tangent tangent = !exact                ? Tangent::held_rotation
                      : positive_steps_ > 0 ? Tangent::positive
                                            : Tangent::exact;
    positive_steps_ = std::max(0, positive_steps_ - 1);
    const SolveRecord* done = effort.as_done && report.linearisations < max_recorded_solves
                                  ? &(*effort.as_done)[report.linearisations]
                                  : nullptr;
    bool by_halves =
        done ? done->half_renewed : settling_steps_ == 0 && (effort.by_halves || is_late(effort));
    for (;;) {
        const bool half = assemble(c, tangent, by_halves);
        const double assembly_s = watch.lap();
        report.half_renewed |= half;
        report.operator_s += assembly_s;
        const double whole_s = half ? whole_over_half * assembly_s : assembly_s;
        // New constraints and time steps take more, once.
        renewal_s_ +=
            lately * ((renewal_s_ > 0 ? std::min(whole_s, 2 * renewal_s_) : whole_s) - renewal_s_);
        const int most = done                    ? std::max(done->iterations, 1)
                         : effort.iterations > 0 ? effort.iterations
                                                 : options_.max_iterations;
        operator_.set_up_preconditioner();
        report.preconditioner_s += watch.lap();
        const LinearControls how{effort.linear_tolerance, most, effort.deadline};
        const Vec guesses[] = {previous_[0].get(), previous_[1].get()};
        const std::size_t guessed = report.linearisations == 0 ? guesses_ : 0;
        const LinearReport linear = operator_.solve(residual_.get(), volume_.get(), du_.get(),
                                                    dp_.get(), how, std::span(guesses, guessed));
        const double solve_s = watch.lap();
        report.solve_s += solve_s;
        linear_solves_.seconds += solve_s;
        linear_solves_.times += linear.iterations;
        report.iterations += linear.iterations;
        if (report.linearisations < max_recorded_solves)
            report.solves[report.linearisations] = {linear.iterations, half};
        report.cut_short |= linear.cut_short;
        report.solve_error = linear.error;
        if (half && !done && leads_astray(linear)) {
            by_halves = report.half_renewed = false;
            continue;
        }
        // A direction that goes up is what an operator gives that is not positive, though Krylov
        // may not have seen it.
        if ((linear.converged && downhill() > 0) || tangent != Tangent::exact) return linear;
        tangent = Tangent::positive;
        positive_steps_ = 2;
    }
}

bool DeformableBody::leads_astray(const LinearReport& linear) const {
    // Not by VecNorm: the first time it makes room for what it remembers, and a frame allocates
    // nothing.
    const ReadArray du(du_.get());
    std::atomic<double> largest{0};
    over_components([&](std::size_t begin, std::size_t end) {
        double of_piece = 0;
        for (std::size_t i = begin; i < end; ++i)
            if (const double d = std::abs(du[i]); !(d <= of_piece) && !std::isnan(of_piece))
                of_piece = d;
        raise_to(largest, of_piece);
    });
    const double reach = largest.load();
    return (usual_way_ > 0 && !(reach <= astray * std::max(way_, usual_way_))) ||
           !(linear.residual <= residual_norm());
}

StepReport DeformableBody::step(double dt, const StepControls& effort) {
    const TimeCoefficients c = time_coefficients(time_, dt);
    StepReport report;
    Stopwatch watch;
    LIVETET_PETSC(VecCopy(u_.get(), u0_.get()));
    if (p_) LIVETET_PETSC(VecCopy(p_.get(), p0_.get()));
    take_rotations();
    if (is_dynamic() && !started_) start_acceleration();
    start_scale_ = 0;
    positive_steps_ = 0;
    const bool live = effort.tolerance == 0;
    way_ = find_prescribed();
    const bool moved = way_ != 0;
    settling_steps_ =
        way_ > sudden * usual_way_ ? steps_to_settle : std::max(0, settling_steps_ - 1);
    if (std::isfinite(way_)) usual_way_ += lately * (way_ - usual_way_);
    const bool at_once = live && operator_.fine().holds_rotations();
    double imbalance = evaluate_residual(c, at_once && moved);
    start_scale_ = scale_;
    if (moved && !at_once) imbalance = subtract_prescribed(c);
    const bool is_linear = operator_.fine().strain() == StrainModel::linear;
    if (!live && !is_dynamic() && !is_linear)
        guesses_ = 0;  // load steps need not go on as they went
    report.forces_s += watch.lap();
    // A body let go comes ever closer to rest, frame by frame, down to numbers that processors are
    // slow with.
    const double nothing = far_below_round_off * round_off_;
    for (int k = 0; k < effort.linearisations; ++k) {
        if (k > 0 && imbalance <= allowed(effort)) break;
        if (imbalance <= nothing && !(k == 0 && moved)) break;
        const LinearReport linear = solve_linear(c, effort, report);
        watch.lap();
        report.converged =
            report.converged &&
            (linear.converged ||
             (linear.cut_short && (effort.deadline || effort.iterations > 0 || effort.as_done)));
        report.linear_residual = imbalance > 0 ? linear.residual / imbalance : 0;
        ++report.linearisations;
        if (k == 0 && (live || is_dynamic() || is_linear)) {
            for (PetscHandle<Vec>& v : previous_)
                if (!v) v = vector();
            std::swap(previous_[0], previous_[1]);
            LIVETET_PETSC(VecCopy(du_.get(), previous_[0].get()));
            guesses_ = std::min(guesses_ + 1, 2);
        }
        if (k == 0 && (moved || live)) {
            move(1);
            LIVETET_PETSC(VecAXPY(u_.get(), 1, prescribed_.get()));
            if (!live || effort.linearisations > 1) {  // else a live frame, which does not ask
                take_rotations();
                imbalance = evaluate_residual(c);
            }
        } else {
            imbalance = search_line(c, imbalance);
        }
        (live && effort.linearisations == 1 ? report.finish_s : report.forces_s) += watch.lap();
        if (!is_finite() || !std::isfinite(imbalance)) {
            LIVETET_PETSC(VecCopy(u0_.get(), u_.get()));
            if (p_) LIVETET_PETSC(VecCopy(p0_.get(), p_.get()));
            take_rotations();
            report.converged = false;
            report.kept_old = true;
            report.imbalance = 1;
            guesses_ = 0;
            return report;  // velocity and acceleration stay too: the body waits
        }
    }
    report.imbalance = scale_ > 0 ? imbalance / scale_ : 0;
    if (effort.tolerance > 0) report.converged = imbalance <= allowed(effort);
    finish_step(c, dt, report);
    report.finish_s += watch.lap();
    rest_s_ +=
        lately * (report.solve_s / std::max(1, report.iterations) + report.finish_s - rest_s_);
    return report;
}

void DeformableBody::move(double length) {
    LIVETET_PETSC(VecAXPY(u_.get(), length, du_.get()));
    if (p_) LIVETET_PETSC(VecAXPY(p_.get(), length, dp_.get()));
}

double DeformableBody::allowed(const StepControls& effort) const {
    return std::max(effort.tolerance * scale_, effort.tolerance > 0 ? round_off_ : 0);
}

double DeformableBody::downhill() const {
    PetscScalar slope = 0, of_pressure = 0;
    LIVETET_PETSC(VecDot(residual_.get(), du_.get(), &slope));
    if (volume_) LIVETET_PETSC(VecDot(volume_.get(), dp_.get(), &of_pressure));
    return slope + (volume_ ? of_pressure / operator_.coupling().scale() : 0);
}

double DeformableBody::search_line(const TimeCoefficients& c, double norm_before) {
    // Along d, the energy's slope is -residual . d: a step is long enough, and not too long, where
    // the slope has come near zero (PETSc's "critical point" search). In the mixed form the same
    // holds for the monotone operator (dL/du, -dL/dp): the slope takes in the pressures. Where the
    // slope says nothing, the residual's norm decides.
    const double before = downhill();
    double after = 0;
    double length = 1, taken = 0;
    for (int trial = 0;; ++trial) {
        move(length - taken);
        taken = length;
        take_rotations();
        const double norm_after = evaluate_residual(c);
        after = downhill();
        const bool good = before <= 0 ? norm_after <= (1 - 1e-4 * length) * norm_before
                                      : after >= -0.9 * before || norm_after <= 0.5 * norm_before;
        if ((good && std::isfinite(norm_after)) || trial == 6) return norm_after;
        const double ideal = before > 0 && std::isfinite(after) ? before / (before - after) : 0.5;
        length *= std::clamp(ideal, 0.1, 0.5);
    }
}

void DeformableBody::finish_step(const TimeCoefficients& c, double dt, StepReport& report) {
    update_ghosts(u_.get());
    if (!is_dynamic()) return;
    const auto constrained = operator_.fine().constrained();
    const auto mass = operator_.fine().node_mass();
    const ReadArray u(u_.get()), u0(u0_.get());
    WriteArray v(v_.get()), a(a_.get());
    std::optional<WriteArray> net;
    if (net_) net.emplace(net_.get());
    std::atomic<double> largest{0};
    over_components([&](std::size_t begin, std::size_t end) {
        double error = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const double du = u[i] - u0[i], v0 = v[i], a0 = a[i];
            if (constrained[i / 3] >> (i % 3) & 1) {
                // A prescribed motion has the velocity of its step: the scheme's own would ring on
                // for ever.
                v[i] = du / dt;
                a[i] = 0;
            } else {
                v[i] = c.v_u * du + c.v_v * v0 + c.v_a * a0;
                a[i] = c.a_u * du - c.a_v * v0 - c.a_a * a0;
            }
            error = std::max(error, std::abs(a[i] - c.error_from * a0));
            if (net)
                (*net)[i] = (mass[i / 3] * ((1 - c.alpha_m) * a[i] + c.alpha_m * a0) -
                             c.alpha_f * (*net)[i]) /
                            (1 - c.alpha_f);
        }
        raise_to(largest, error);
    });
    report.time_error = c.error * largest.load();
    const PartitionedMesh& share = operator_.fine().share();
    if (share.ranks > 1)
        MPI_Allreduce(MPI_IN_PLACE, &report.time_error, 1, MPI_DOUBLE, MPI_MAX, share.comm);
}

bool DeformableBody::is_finite() const {
    return norm(u_.get()) <= farthest_ && (!p_ || std::isfinite(norm(p_.get())));
}

}  // namespace livetet
