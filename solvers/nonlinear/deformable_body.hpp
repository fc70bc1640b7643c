#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "mechanics/constraints.hpp"
#include "mechanics/time_scheme.hpp"
#include "solvers/linear/linear_solver.hpp"

namespace livetet {

/// A step makes this many linearisations at most where it is to be done again to the bit.
constexpr int max_recorded_solves = 4;

/// What a deadline left of one linearisation's solve.
struct SolveRecord {
    int iterations = 0;
    bool half_renewed = false;
};

/// What one step, or one static solve, came to. Times in seconds.
struct [[nodiscard]] StepReport {
    bool converged = true;  ///< every linear solve met its tolerance or was cut short, and Newton
                            ///< met its own if asked to
    bool cut_short =
        false;  ///< the deadline, or the iterations allowed, came before the linear tolerance
    bool half_renewed = false;  ///< the deadline left time for half of the operator; the other half
                                ///< is the next step's
    bool kept_old = false;      ///< the new state was not finite
    int linearisations = 0;
    int iterations = 0;                                     ///< of all linear solves
    std::array<SolveRecord, max_recorded_solves> solves{};  ///< of the first linearisations
    double imbalance = 0;  ///< force out of balance relative to the forces at work: at the end
                           ///< where a tolerance was asked for, else before the last linear solve
    double linear_residual = 0;  ///< of the last linear solve, relative to its right-hand side
    double solve_error = 0;  ///< what the step left unsolved of its displacement, m, RMS over the
                             ///< nodes, estimated; live only
    double time_error =
        0;  ///< the displacement's error that the time step made, m, about (largest of all nodes)
    double forces_s = 0, operator_s = 0, solve_s = 0;
    double preconditioner_s = 0;  ///< its set-up, where it has one apart from the operators
    double finish_s = 0;          ///< of a live step: what came after its last solve

    /// All stages together.
    double seconds() const { return forces_s + operator_s + preconditioner_s + solve_s + finish_s; }
};

/// How far a step goes: `linearisations` at most, stopping early at `tolerance` (force out of
/// balance relative to the forces at work); each linear solve to `linear_tolerance`, by at most
/// `iterations` (0: as the solver's options say) and not past the deadline.
struct StepControls {
    int linearisations = 1;
    double tolerance = 0;
    double linear_tolerance = 1e-3;
    int iterations = 0;
    std::optional<Clock::time_point> deadline{};
    /// Live: one half of the operator, the other by the next step, however far the deadline is; not
    /// soon after a jump.
    bool by_halves = false;
    /// Live: as an earlier step was done, whose `StepReport::solves` these are, without a deadline:
    /// the same to the bit.
    const std::array<SolveRecord, max_recorded_solves>* as_done = nullptr;
};

/// All that a body needs to go on from where it is, in the whole mesh's numbering: the same on any
/// number of ranks.
struct BodySnapshot {
    /// Of each node: displacement, m; where the body is dynamic velocity, m/s, and acceleration,
    /// m/s^2; with generalized-alpha the forces at the last step's end, N.
    std::vector<std::vector<Vector3>> nodal;
    std::vector<double>
        pressure;          ///< mixed form: of each corner, in the solver's own unit; else empty
    bool started = false;  ///< the acceleration is known
};

/// Of a body's parts: the operator's; and velocities with all that a dynamic body keeps beside its
/// mass; forces; iterations of linear solves.
struct BodyCosts : SolverCosts {
    PhaseCost velocities, forces, linear_solves;
};

/// A deformable body with its constraints, loads and state of motion: M u'' + C u' + f_int(u) =
/// f_ext with C = alpha M + beta K, stepped by Newmark, generalized-alpha or implicit Euler, or
/// brought to equilibrium. In the mixed form a pressure goes with the displacement, and C knows
/// only the K of shear.
class DeformableBody {
  public:
    /// Collective; see LinearSolver.
    DeformableBody(MPI_Comm comm, const MeshHierarchy& hierarchy,
                   std::span<const std::vector<std::int32_t>> parts, const ElasticModel& model,
                   const TimeOptions& time, const SolverOptions& options);

    /// Constraints of the finest mesh. What is constrained may change between steps; new values
    /// alone cost nothing.
    void set_constraints(const Constraints& constraints);
    /// New values of components that are constrained already.
    void move_constraints(std::span<const std::int32_t> nodes, std::span<const Vector3> values);
    /// Soft constraints; new targets alone cost nothing.
    void set_springs(const Springs& springs);
    /// External force at each node of the finest mesh, N: `share` times what is given; empty: none.
    void set_external_force(std::span<const Vector3> force, double share = 1);

    /// One step of `dt` seconds (static: to equilibrium, dt unused). Always leaves a finite state:
    /// where the new one is not, the old one is kept and the report says converged = false.
    StepReport step(double dt, const StepControls& effort);

    /// Takes up displacement, velocity and acceleration of a body on the same mesh and of the same
    /// scheme.
    void copy_state(const DeformableBody& other);
    /// The state on every rank; and a body of the same mesh and scheme takes it up. Collective.
    /// Throws Error where it is of another size.
    BodySnapshot gather_state() const;
    void set_state(const BodySnapshot& state);
    /// Remembers the state, or takes up the one remembered last (a step that is to be done again).
    void keep_state();
    void return_to_kept_state();

    /// Displacement, m, of every node of the finest mesh, on every rank.
    std::vector<Vector3> displacement() const { return gather(operator_.fine().share(), u_.get()); }
    /// The same into `values`, whose storage is used again.
    void displacement(std::vector<Vector3>& values) const {
        gather(operator_.fine().share(), u_.get(), values);
    }
    /// Velocity, m/s, likewise; dynamic bodies only.
    std::vector<Vector3> velocity() const { return gather(operator_.fine().share(), v_.get()); }
    /// Elastic force at each node, N.
    std::vector<Vector3> elastic_force();
    /// Force that each constraint puts on its node, N: constrained components and springs; zero
    /// elsewhere.
    std::vector<Vector3> reactions();
    /// Of every tet of the finest mesh, on every rank.
    std::vector<TetFields> tet_fields();
    /// The largest mean von Mises stress of a tet, Pa; collective.
    double largest_von_mises();
    /// How many tets are flat or inside out, their mean det F <= 0: what is read off them, stress
    /// above all, means nothing. (A P2 tet can have a corner inside out without.) Collective.
    std::size_t inverted_tets();
    /// Cauchy's stress, Pa, at every node on every rank: extrapolated in each tet from its
    /// quadrature points, where it is most accurate, and averaged over the tets at a node by their
    /// volume.
    std::vector<Eigen::Matrix3d> nodal_stress();
    double strain_energy();
    double kinetic_energy();
    void set_displacement(std::span<const Vector3> displacement);
    void set_velocity(std::span<const Vector3> velocity);

    /// What the parts of the body took on this rank; nothing where they were left out.
    BodyCosts costs() const;

    LinearSolver& linear_solver() { return operator_; }
    int threads() const { return team_.size(); }

  private:
    PetscHandle<Vec> vector() const { return make_vector(operator_.fine().share()); }
    bool is_dynamic() const { return time_.scheme != TimeScheme::static_equilibrium; }
    Configuration state() const { return {u_.get(), p_.get()}; }
    std::vector<Vec> state_vectors() const;
    std::vector<TetFields> local_tet_fields();
    /// Ghosts of the state, and the rotations there.
    void take_rotations();
    void start_acceleration();
    /// work(begin, end) on pieces of the components of the owned nodes.
    template <class Work>
    void over_components(Work&& work) const {
        team_.run_pieces(3 * static_cast<std::size_t>(operator_.fine().share().owned), 3000, work);
    }
    /// force_ -= what the springs pull with.
    void subtract_spring_pull();
    /// force_ += damping and inertia at u_, as the scheme weighs them; velocity_ is that of u_.
    void add_inertia(const TimeCoefficients& c);
    /// Takes up which nodes are constrained.
    void find_held();
    /// prescribed_ = the way of the constrained nodes to their values; the largest component, 0
    /// where they are there already, m.
    double find_prescribed();
    void zero_constrained(Vec v) const;
    /// Fills residual_ = f_ext - f_int - C v1 - M a1 (as the scheme weighs them), zero at
    /// constrained components, and the constraint's residual in the mixed form; returns their norm
    /// and sets scale_. Rotations must be those of u_. `prescribed`: less the effect of
    /// prescribed_, to first order, in the same loop; where the level holds_rotations().
    double evaluate_residual(const TimeCoefficients& c, bool prescribed = false);
    double residual_norm() const;
    /// Takes the effect of prescribed_ off the residuals, to first order.
    double subtract_prescribed(const TimeCoefficients& c);
    bool assemble(const TimeCoefficients& c, Tangent tangent, bool by_halves);
    /// Whether a whole operator, one iteration and what follows, as long as they take of late,
    /// would miss the deadline.
    bool is_late(const StepControls& effort) const;
    /// du_ (and dp_) from residual_, by the exact tangent where that is asked for and positive.
    LinearReport solve_linear(const TimeCoefficients& c, const StepControls& effort,
                              StepReport& report);
    /// Whether the solve by an operator of which one half is a step old went where no whole one
    /// would: where tets have flipped since, the halves may not fit together.
    bool leads_astray(const LinearReport& linear) const;
    /// residual_ . du_, with the pressures' part: what the energy falls by, to first order.
    double downhill() const;
    /// The force out of balance that counts as none: the tolerance's, or round-off where that is
    /// more.
    double allowed(const StepControls& effort) const;
    /// Goes along du_ as far as is good; returns the norm of the residual there.
    double search_line(const TimeCoefficients& c, double norm);
    void move(double length);
    void finish_step(const TimeCoefficients& c, double dt, StepReport& report);
    /// The state is one: no number of it is not finite, or absurdly far from rest.
    bool is_finite() const;

    TimeOptions time_;
    SolverOptions options_;
    mutable ThreadTeam team_;
    LinearSolver operator_;
    std::vector<std::uint8_t>
        constrained_;  ///< components of every node of the whole mesh, see Constraints
    Springs springs_;
    PetscHandle<Vec> u_, u0_, v_, a_, du_, velocity_, residual_, force_, external_, prescribed_;
    PetscHandle<Vec> at_;  ///< where forces are taken with the rotations held
    std::array<PetscHandle<Vec>, 2>
        previous_;     ///< du_ of the last steps, newest first: what the next is guessed from
    int guesses_ = 0;  ///< how many of them there are
    std::vector<std::int32_t> held_nodes_;  ///< owned nodes with constrained components
    std::vector<Vector3> held_values_;      ///< where to, m
    std::vector<std::int32_t> held_at_;     ///< of each owned node, its place in held_nodes_, or -1
    PetscHandle<Vec> net_;                  ///< generalized-alpha: h0
    PetscHandle<Vec> p_, p0_, dp_,
        volume_;  ///< mixed form: pressure, its increment, the constraint's residual
    std::vector<PetscHandle<Vec>> kept_;
    PhaseCost velocities_, forces_, linear_solves_;
    bool started_ = false, kept_started_ = false;
    double scale_ =
        0;  ///< size of the forces at work, N: now, or when the step began where that is more
    double start_scale_ = 0;
    double external_size_ = 0;  ///< N
    double round_off_ = 0;      ///< N
    double farthest_ = 0;       ///< norm of the displacement, m, beyond which a state is lost
    double renewal_s_ = 0,
           rest_s_ = 0;  ///< running means: a whole operator; one iteration and what follows
    double way_ = 0, usual_way_ = 0;  ///< find_prescribed(), of this step and its running mean, m
    int settling_steps_ = 0;          ///< to come since it jumped
    int positive_steps_ = 0;          ///< linearisations to come that take the positive tangent
};

}  // namespace livetet
