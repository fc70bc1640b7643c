#include "solvers/nonlinear/force_balance.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <optional>

#include "base/piece_sums.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"

namespace livetet {

double norm_of(Vec v) {
    PetscReal norm = 0;
    LIVETET_PETSC(VecNorm(v, NORM_2, &norm));
    return norm;
}

namespace {

/// Norm of displacements, m, beyond which a body is lost: 100 times its own size at every node.
double lost_at(const LevelAssembler& level) {
    constexpr double max_sizes = 100;
    const Eigen::AlignedBox3d box = level.bounding_box();
    const auto nodes = static_cast<double>(level.share().total);
    return max_sizes * box.diagonal().norm() * std::sqrt(nodes);
}

}  // namespace

ForceBalance::ForceBalance(LinearSolver& solver, TimeIntegrator& time, PrescribedMotion& prescribed,
                           BodyState& state, ThreadTeam& team)
    : solver_(solver),
      time_(time),
      prescribed_(prescribed),
      state_(state),
      team_(team),
      rotations_(solver.fine().make_rotations()) {
    const LevelAssembler& fine = solver.fine();
    for (PetscHandle<Vec>* v : {&residual_, &force_, &external_}) *v = fine.make_vector();
    if (fine.has_frozen_force()) at_ = fine.make_vector();
    if (fine.pressure_space()) volume_ = fine.make_pressure_vector();
    farthest_ = lost_at(fine);
    // The rounding of F = I + grad u limits forces to the last digit of the moduli.
    round_off_ = fine.force_epsilon() * fine.force_at_unit_strain();
}

void ForceBalance::set_springs(const Springs& springs) {
    const bool is_new = on_any_rank(level().share(), springs.stiffness != springs_.stiffness);
    springs_ = springs;
    if (is_new) solver_.set_springs(springs_.stiffness);
}

void ForceBalance::set_external_force(std::span<const Vector3> force, double share) {
    {
        // Not VecSet: a rank without nodes has no forces where others have some, and VecSet lets
        // PETSc pass over the norm's sum there.
        WriteArray to(external_.get());
        for (std::size_t i = 0; i < to.span().size(); ++i)
            to[i] = force.empty() ? 0 : share * force[i / 3][static_cast<Eigen::Index>(i % 3)];
    }
    external_size_ = norm_of(external_.get());
}

void ForceBalance::update_rotations() {
    update_ghosts(state_.u.get());
    if (state_.p) update_ghosts(state_.p.get());
    solver_.update_rotations(state_.u.get(), rotations_);
}

void ForceBalance::reset_pressures() {
    if (!state_.p) return;
    LIVETET_PETSC(VecSet(state_.p.get(), 0));
    if (level().share().hexahedra.empty()) return;
    update_rotations();
    solver_.coupling()->evaluate(configuration(), force_.get(), volume_.get());
    solver_.coupling()->pressures_of(volume_.get(), state_.p.get());
}

bool ForceBalance::damps_from_start() const {
    return damping_at_ == DampingAt::start && time_.is_dynamic() && time_.rayleigh_beta() > 0 &&
           !level().is_linear() && level().keeps_damping();
}

void ForceBalance::begin_step(DampingAt damping) {
    start_scale_ = 0;
    damping_at_ = damping;
    update_rotations();
    if (damps_from_start()) solver_.fine().keep_damping(configuration());
}

void ForceBalance::add_stiffness_damping(Vec v) {
    const double beta = time_.rayleigh_beta();
    if (beta == 0) return;
    update_ghosts(v);
    if (damps_from_start()) {
        level().add_damping_times(beta, v, force_.get());
        return;
    }
    level().add_stiffness_times(beta, configuration(), v, force_.get());
}

double ForceBalance::residual_norm() const {
    return volume_ ? std::hypot(residual_size_, norm_of(volume_.get())) : residual_size_;
}

void ForceBalance::evaluate_frozen(ForcesAt forces_at) {
    // With frozen rotations forces are affine: f(u) + beta K v1 + (1 + beta v_u) K w is the force
    // at one displacement, u + (1 + beta v_u) w + beta v1.
    const double beta = time_.rayleigh_beta();
    Vec at = state_.u.get();
    const bool adds_velocity = time_.is_dynamic() && beta > 0 && !damps_from_start();
    const bool adds_prescribed = forces_at == ForcesAt::prescribed;
    if (adds_prescribed || adds_velocity) {
        at = at_.get();
        const double of_w = adds_prescribed ? time_.stiffness_factor() : 0;
        const ReadArray u(state_.u.get()), w(prescribed_.increment()),
            v1(adds_velocity ? time_.velocity() : state_.u.get());
        const double of_v = adds_velocity ? beta : 0;
        WriteArray y(at);
        over_components(team_, level(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) y[i] = u[i] + of_w * w[i] + of_v * v1[i];
        });
    }
    if (at != state_.u.get()) update_ghosts(at);
    level().frozen_force(at, rotations_, force_.get());
}

double ForceBalance::evaluate(ForcesAt forces_at, Vec along) {
    static const PetscLogEvent event = log_event("LivetetForces");
    const PhaseTimer timer(cost_, event);
    const LevelAssembler& fine = level();
    if (time_.is_dynamic()) time_.find_velocity();
    if (fine.has_frozen_force())
        evaluate_frozen(forces_at);
    else if (volume_)
        solver_.coupling()->evaluate(configuration(), force_.get(), volume_.get());
    else
        fine.elastic_force(configuration(), force_.get());
    if (along) LIVETET_PETSC(VecDot(force_.get(), along, &elastic_along_));
    // evaluate_frozen has damped by the present stiffness.
    if (time_.is_dynamic() && (damps_from_start() || !fine.has_frozen_force()))
        add_stiffness_damping(time_.velocity());
    subtract_spring_pull();
    double size = 0;  // of the force without inertia
    if (time_.is_dynamic()) {
        size = norm_of(force_.get());
        time_.add_inertia(force_.get());
    }
    {
        const ReadArray f(force_.get()), external(external_.get()),
            net(state_.end_force ? state_.end_force.get() : external_.get());
        const double of_net = time_.history_weight();
        WriteArray r(residual_.get());
        const double of_whole_force = write_residual([&](std::size_t i, bool is_free) {
            r[i] = is_free ? external[i] - f[i] + of_net * net[i] : 0;
            return Eigen::Array2d{f[i], r[i]};
        });
        if (!time_.is_dynamic()) size = of_whole_force;
    }
    scale_ = std::max(start_scale_, size + external_size_);
    return residual_norm();
}

template <class Write>
double ForceBalance::write_residual(Write&& write) {
    using Squares = Eigen::Array<double, 2, 3>;  // of the force and of the residual, by axis
    const auto constrained = level().constrained();
    const auto of_nodes = [&](std::size_t begin, std::size_t end) -> Squares {
        Squares squares = Squares::Zero();
        for (std::size_t n = begin; n < end; ++n)
            for (int axis = 0; axis < 3; ++axis)
                squares.col(axis) += write(3 * n + axis, !(constrained[n] >> axis & 1)).square();
        return squares;
    };
    const PartitionedMesh& share = level().share();
    Eigen::Array2d sums = sum_in_pieces(team_, share.owned, of_nodes).rowwise().sum();
    sum_over_ranks(share.comm, {sums.data(), 2});
    residual_size_ = std::sqrt(sums[1]);
    return std::sqrt(sums[0]);
}

void ForceBalance::subtract_spring_pull() {
    const LevelAssembler& fine = level();
    const auto springs = fine.springs();
    if (springs.empty()) return;
    const ReadArray u(state_.u.get());
    WriteArray f(force_.get());
    for (std::size_t i = 0; i < f.span().size(); ++i)
        if (springs[i / 3] > 0) f[i] -= springs[i / 3] * (springs_.target[i / 3][i % 3] - u[i]);
}

double ForceBalance::subtract_prescribed() {
    Vec w = prescribed_.increment();
    update_ghosts(w);
    const double factor = time_.stiffness_factor();
    if (volume_) {
        solver_.coupling()->add_increments(configuration(), factor, w, force_.get(), volume_.get());
    } else {
        LIVETET_PETSC(VecSet(force_.get(), 0));
        level().add_stiffness_times(factor, configuration(), w, force_.get(), Support::constrained);
    }
    {
        const ReadArray f(force_.get());
        WriteArray r(residual_.get());
        const double size = write_residual([&](std::size_t i, bool is_free) {
            const double change = is_free ? f[i] : 0;
            r[i] -= change;
            return Eigen::Array2d{change, r[i]};
        });
        scale_ = std::max(scale_, size);
    }
    return residual_norm();
}

double ForceBalance::slope(Vec du, Vec dp) const {
    PetscScalar of_u = 0, of_p = 0;
    LIVETET_PETSC(VecDot(residual_.get(), du, &of_u));
    if (!volume_) return of_u;
    LIVETET_PETSC(VecDot(volume_.get(), dp, &of_p));
    return of_u + of_p / solver_.coupling()->scale();
}

void ForceBalance::start_acceleration() {
    level().elastic_force(configuration(), force_.get());
    subtract_spring_pull();
    add_stiffness_damping(state_.v.get());
    time_.start_acceleration(force_.get(), external_.get());
}

OperatorTerms ForceBalance::terms(Tangent tangent) const {
    OperatorTerms terms{
        .stiffness = time_.stiffness_factor(), .mass = time_.mass_factor(), .tangent = tangent};
    if (damps_from_start()) {
        terms.damping = terms.stiffness - 1;
        terms.stiffness = 1;
    }
    return terms;
}

RenewalExtent ForceBalance::assemble(Tangent tangent, RenewalExtent wanted) {
    return solver_.assemble(configuration(), terms(tangent), wanted);
}

const char* ForceBalance::state_fault() const {
    const double norm = norm_of(state_.u.get());
    if (!std::isfinite(norm)) return "the displacement is not finite";
    if (norm > farthest_)
        return "the displacement is more than 100 times the body's size: is the body held?";
    if (state_.p && !std::isfinite(norm_of(state_.p.get()))) return "the pressure is not finite";
    return nullptr;
}

std::vector<Vector3> ForceBalance::elastic_force() {
    update_rotations();
    level().elastic_force(configuration(), force_.get());
    return local_values(level().share(), force_.get());
}

std::vector<Vector3> ForceBalance::reactions() {
    const LevelAssembler& fine = level();
    update_rotations();
    fine.elastic_force(configuration(), force_.get());
    if (time_.is_dynamic()) {
        add_stiffness_damping(state_.v.get());
        time_.add_state_inertia(force_.get());
    }
    {
        const auto constrained = fine.constrained();
        const auto springs = fine.springs();
        const ReadArray u(state_.u.get()), external(external_.get());
        WriteArray f(force_.get());
        for (std::size_t i = 0; i < f.span().size(); ++i) {
            if (constrained[i / 3] >> (i % 3) & 1)
                f[i] -= external[i];
            else
                f[i] =
                    springs.empty() ? 0 : springs[i / 3] * (springs_.target[i / 3][i % 3] - u[i]);
        }
    }
    return local_values(fine.share(), force_.get());
}

}  // namespace livetet
