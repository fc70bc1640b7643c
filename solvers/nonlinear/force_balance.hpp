#pragma once

#include "solvers/linear/linear_solver.hpp"
#include "solvers/nonlinear/prescribed_motion.hpp"
#include "solvers/nonlinear/time_integrator.hpp"

namespace livetet {

/// The equations that a step solves for the displacement u at its end, and in the mixed form for
/// the pressure p,
///
///     r(u, p) = f_ext - f_int(u, p) - f_springs(u) - C v1(u) - M a1(u) = 0,
///     g(u, p) = integral N_i (theta(u) - p / lambda) = 0,
///
/// with v1 and a1 as the time scheme has them; r is zero at constrained components. Damping is
/// C = alpha M + beta K_d. K_d is the stiffness at the step's start, so that r has an exact and
/// continuous derivative; or, for frames, at the present u. Within a step that the TimeIntegrator
/// has begun:
///
///     begin_step(damping);   // the rotations are those of the step's start, too
///     evaluate();          // residual() and volume_residual() at u
///     assemble(tangent);   // -dr/du at u, and what belongs to p, into the linear solver
///
/// and after each change of u update_rotations() and evaluate() again.
class ForceBalance {
  public:
    /// All must outlive this.
    ForceBalance(LinearSolver& solver, TimeIntegrator& time, PrescribedMotion& prescribed,
                 BodyState& state, ThreadTeam& team);

    void set_springs(const Springs& springs);
    /// External force at each local node, N, times `share`; empty: none. Collective.
    void set_external_force(std::span<const Vector3> force, double share);
    Vec external() const { return external_.get(); }

    /// Sets the pressures, if there are any, for a displacement that was set: on tets zero, on
    /// hexahedra lambda times each cell's mean of theta.
    void reset_pressures();

    /// Where K_d is taken.
    enum class DampingAt { start, present };
    /// The state is that of the step's start. Ends with update_rotations().
    void begin_step(DampingAt damping);
    /// Ghosts of the state, and the rotations at its displacement.
    void update_rotations();
    /// Where the body is; update_rotations() was called at this u.
    Configuration configuration() const {
        return {state_.u.get(), state_.p ? state_.p.get() : cell_pressures_, &rotations_};
    }

    /// Residuals at u; returns their norm and renews scale().
    double evaluate() { return evaluate(ForcesAt::present, nullptr); }
    /// The same, and finds elastic_along(): f_int . direction, J.
    double evaluate_along(Vec direction) { return evaluate(ForcesAt::present, direction); }
    double elastic_along() const { return elastic_along_; }
    /// Elastic energy at u, J. Collective.
    double elastic_energy() const { return level().strain_energy(configuration()); }
    /// The same with the prescribed increment applied to first order; only where the level
    /// has_frozen_force().
    double evaluate_with_prescribed() { return evaluate(ForcesAt::prescribed, nullptr); }
    /// Applies the prescribed increment to the residuals to first order: r(u + w) = r(u) - A w
    /// about. Evaluating forces at u avoids inverting the elements beside the prescribed nodes.
    /// Returns the residuals' norm.
    double subtract_prescribed();
    double residual_norm() const;
    Vec residual() const { return residual_.get(); }
    Vec volume_residual() const { return volume_.get(); }  ///< null in the displacement form
    /// r . du, with the pressures' part: the decrease of the energy along (du, dp), to first order,
    /// J.
    double slope(Vec du, Vec dp) const;
    /// force() = f_int, less the springs' pull, with damping by beta K v at the state's v: what an
    /// acceleration starts from.
    void start_acceleration();

    /// The operator at configuration() into the linear solver. Returns what was renewed: a half
    /// only if that is wanted and the solver can.
    RenewalExtent assemble(Tangent tangent, RenewalExtent wanted);
    void assemble(Tangent tangent) { (void)assemble(tangent, RenewalExtent::whole); }

    /// Size of the forces at work, N: now, or after keep_scale() if that was more.
    double scale() const { return scale_; }
    void keep_scale() { start_scale_ = scale_; }
    /// Norm of forces, N, far below round-off: smaller forces are taken for zero, whatever the
    /// contrast of moduli.
    double negligible() const { return 1e-12 * round_off_; }
    /// Largest residual that `tolerance`, relative to scale(), allows, N; round-off where that is
    /// more.
    double allowed(double tolerance) const { return std::max(tolerance * scale_, round_off_); }
    /// Why the state is not to be used, in words: it is not finite, or absurdly far from rest. Null
    /// if it can be. Collective.
    const char* state_fault() const;

    /// Force that each constraint puts on its node, N: constrained components and springs; zero
    /// elsewhere, on every rank. Collective.
    std::vector<Vector3> reactions();
    /// Elastic force at each node, N, on every rank. Collective.
    std::vector<Vector3> elastic_force();

    const PhaseCost& cost() const { return cost_; }
    double rotation_bytes() const { return rotations_.bytes(); }
    const LevelAssembler& level() const { return solver_.fine(); }

  private:
    friend class AtCellPressures;
    enum class ForcesAt { present, prescribed };
    double evaluate(ForcesAt forces_at, Vec along);
    void evaluate_frozen(ForcesAt forces_at);
    /// Whether K_d is kept from the step's start.
    bool damps_from_start() const;
    /// force_ += beta K_d v, or beta K v at the present u; ghosts of v are updated.
    void add_stiffness_damping(Vec v);
    OperatorTerms terms(Tangent tangent) const;
    void subtract_spring_pull();
    /// Calls write(i, is_free), which writes component i of the residual and returns {force,
    /// residual}: that of the force and of the residual. Keeps the residual's norm, and returns the
    /// force's.
    template <class Write>
    double write_residual(Write&& write);

    LinearSolver& solver_;
    TimeIntegrator& time_;
    PrescribedMotion& prescribed_;
    BodyState& state_;
    ThreadTeam& team_;
    Springs springs_;
    ElementRotations rotations_;
    PetscHandle<Vec> residual_, force_, external_;
    DampingAt damping_at_ = DampingAt::present;
    PetscHandle<Vec> at_;      ///< where forces are taken with frozen rotations, m
    PetscHandle<Vec> volume_;  ///< mixed form: g
    Vec cell_pressures_ = nullptr;
    double elastic_along_ = 0;
    double scale_ = 0, start_scale_ = 0;
    double external_size_ = 0;
    double residual_size_ = 0;
    double round_off_ = 0;
    double farthest_ = 0;  ///< norm of the displacement, m, beyond which a state is lost
    PhaseCost cost_;
};

/// Has configuration() name these pressures of cells, in place of eliminated ones, while it lives;
/// null: none.
class AtCellPressures {
  public:
    AtCellPressures(ForceBalance& balance, Vec p) : place_(balance.cell_pressures_) { place_ = p; }
    ~AtCellPressures() { place_ = nullptr; }
    AtCellPressures(const AtCellPressures&) = delete;
    AtCellPressures& operator=(const AtCellPressures&) = delete;

  private:
    Vec& place_;
};

/// Euclidean norm. Collective.
double norm_of(Vec v);

}  // namespace livetet
