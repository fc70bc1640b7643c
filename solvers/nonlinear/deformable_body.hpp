#pragma once

#include <span>
#include <vector>

#include "mechanics/constraints.hpp"
#include "solvers/nonlinear/frame_stepper.hpp"
#include "solvers/nonlinear/newton_solver.hpp"

namespace livetet {

/// Time and memory of a body's parts on this rank: the linear solver's; velocities, with all that a
/// dynamic body keeps beside its mass; forces; iterations of linear solves.
struct BodyCosts {
    SolverCosts solver;
    PhaseCost velocities, forces, linear_solves;
};

/// A deformable body with its constraints, loads and state of motion: M u'' + C u' + f_int(u) =
/// f_ext with C = alpha M + beta K, stepped by Newmark, generalized-alpha or implicit Euler, or
/// brought to equilibrium. In the mixed form a pressure goes with the displacement, and C knows
/// only the K of shear. It composes BodyState, LinearSolver, TimeIntegrator, ForceBalance,
/// NewtonSolver and FrameStepper. To use it: set constraints, springs and forces; then, as often as
/// wanted, move what is prescribed and call `solve` (to a tolerance, by Newton's method) or
/// `advance` (a frame that aims at a deadline). Bad arguments throw Error and change nothing. One
/// thread of a process uses bodies at a time: PETSc is not thread-safe.
///
/// Arrays of nodes have one value for each node that this rank has (PartitionedMesh::nodes): on one
/// rank all of the finest mesh, in its order; on several the rank's own, then its ghosts. What is
/// given for ghosts is passed over; what is returned for them is their owner's. On several ranks
/// all members but those for costs are collective.
class DeformableBody {
  public:
    /// Collective; see make_linear_solver. On one rank the hierarchy must outlive the body;
    /// materials and options are copied. Throws Error as check_body_input does.
    DeformableBody(DistributedHierarchy mesh, const ElasticModel& model, const TimeOptions& time,
                   const SolverOptions& options);
    DeformableBody(const DeformableBody&) = delete;
    DeformableBody& operator=(const DeformableBody&) = delete;

    /// What is constrained may change between steps; new values alone cost nothing. Throws Error
    /// if they are of another number of nodes.
    void set_constraints(const Constraints& constraints);
    /// New values of components that are constrained already. Throws Error if there is not one
    /// value for each node, or if a node does not exist or has no constrained component.
    void move_constraints(std::span<const std::int32_t> nodes, std::span<const Vector3> values);
    /// Soft constraints; new targets alone cost nothing. Throws Error if they are of another number
    /// of nodes.
    void set_springs(const Springs& springs);
    /// External force at each node, N: `share` times what is given; empty: none. Throws Error if it
    /// is of another number of nodes.
    void set_external_force(std::span<const Vector3> force, double share = 1);

    /// `solve`: one step of `dt` seconds, by Newton's method to a tolerance. `advance`: one frame
    /// of `dt` seconds. It ends its linear solve so as to meet the deadline; forces, the operator
    /// and, unless the body is at rest, one iteration are always made, so it can be late. A static
    /// body goes towards equilibrium in both, and dt is not used; a dynamic one throws Error unless
    /// dt > 0. Both leave a finite state: if the new one is not usable, the old one is kept, and
    /// the report says kept_old, not converged, and the reason. Collective.
    StepReport solve(double dt, const SolveControls& controls);
    StepReport advance(double dt, const FrameControls& controls);

    /// Linearises the forces at the present state: assembles the exact tangent K = d f_int / du,
    /// with springs, for `responses`. Any step, or a change of constraints or springs, ends its
    /// validity. Throws Error if the body is dynamic. Collective.
    void linearise();
    /// X with K X = B, m, for forces B, N, by the tangent of the last `linearise`: the changes of
    /// an equilibrium by small extra forces. Each column has three numbers for each node.
    /// Constrained components are zero; their forces are passed over. K is symmetric,
    /// in the mixed form with the pressures eliminated too, so that this is its own adjoint. The
    /// report is that of the last column, or of the first that did not converge, where it ends.
    /// Throws Error if `forces` is of another number of nodes. Collective.
    LinearReport responses(const Eigen::MatrixXd& forces, double relative_tolerance,
                           Eigen::MatrixXd& displacements);

    /// Takes up the state of a body on the same mesh and of the same scheme. Throws Error if that
    /// is of another scheme or form.
    void copy_state(const DeformableBody& other) { state_.copy_from(other.state_); }
    /// The state, each rank's block of it; a body of the same mesh and scheme takes it up on any
    /// number of ranks. Collective. Throws Error where it is of another size.
    BodySnapshot gather_state() const { return livetet::gather_state(mesh(), state_); }
    void set_state(const BodySnapshot& snapshot);
    /// Takes what the frames of another body have taught it of times and motion; see FrameStepper.
    void learn_from(const DeformableBody& other) { stepper_.learn_from(other.stepper_); }
    /// Remembers the state, or takes up the one remembered last (a step that is to be done again);
    /// throws Error if there is none.
    void keep_state();
    void return_to_kept_state() { state_.copy_from(kept_); }

    /// Displacement of each node, m; the second into `values`, whose storage is used again.
    std::vector<Vector3> displacement() const { return local_values(mesh(), state_.u.get()); }
    void displacement(std::vector<Vector3>& values) const {
        local_values(mesh(), state_.u.get(), values);
    }
    /// Velocity, m/s, likewise. Throws Error if the body is static.
    std::vector<Vector3> velocity() const;
    /// Throw Error if they are of another number of nodes; the second if the body is static.
    void set_displacement(std::span<const Vector3> displacement);
    void set_velocity(std::span<const Vector3> velocity);

    /// Elastic force at each node, N.
    std::vector<Vector3> elastic_force() { return balance_.elastic_force(); }
    /// Force that each constraint puts on its node, N: constrained components and springs; zero
    /// elsewhere.
    std::vector<Vector3> reactions() { return balance_.reactions(); }
    /// Mean fields of the tets in this rank's block of the finest mesh (see row_range): of all on
    /// one rank. Collective.
    std::vector<TetFields> tet_fields();
    /// The largest mean von Mises stress of a tet, Pa; collective.
    double largest_von_mises();
    /// Number of flat or inverted tets, of mean det F <= 0: their stresses are meaningless. (A P2
    /// tet with an inverted corner can have a positive mean.) A pass over all tets on one thread.
    /// Collective.
    std::size_t inverted_tets();
    /// Cauchy's stress, Pa, at each node: extrapolated in each tet from its
    /// quadrature points, where it is most accurate, and averaged over the tets at a node by their
    /// volume.
    std::vector<Eigen::Matrix3d> nodal_stress();
    /// J; collective.
    double strain_energy();
    double kinetic_energy();

    BodyCosts costs() const;
    /// Lumped mass of each node that this rank owns, kg; a static body computes it now.
    std::span<const double> node_mass();
    const LinearSolver& linear_solver() const { return *solver_; }
    int threads() const { return team_.size(); }

  private:
    const LevelAssembler& level() const { return solver_->fine(); }
    const PartitionedMesh& mesh() const { return level().share(); }
    void check_size(std::size_t found, const char* what) const;
    void check_dynamic(const char* what) const;
    Configuration configuration();
    std::vector<TetFields> local_tet_fields();
    /// One step of `dt` seconds: begins it, has `work` find the new state, ends it.
    template <class Work>
    StepReport make_step(double dt, ForceBalance::DampingAt damping, Work&& work);
    void begin_step(double dt, ForceBalance::DampingAt damping);
    void end_step(double dt, StepReport& report);

    const SolverOptions options_;
    mutable ThreadTeam team_;
    std::unique_ptr<LinearSolver> solver_;
    BodyState state_, kept_;
    PhaseCost linear_solves_;
    TimeIntegrator time_;
    PrescribedMotion prescribed_;
    ForceBalance balance_;
    NewtonSolver newton_;
    FrameStepper stepper_;
};

}  // namespace livetet
