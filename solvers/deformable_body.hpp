#pragma once

#include <span>
#include <vector>

#include "mechanics/constraints.hpp"
#include "mechanics/time_scheme.hpp"
#include "solvers/elastic_operator.hpp"

namespace livetet {

/// What one step, or one static solve, came to. Times in seconds.
struct [[nodiscard]] StepReport {
    bool converged = true;  ///< every linear solve met its tolerance, and Newton too where it was asked to
    int linearisations = 0;
    int iterations = 0;    ///< of all linear solves
    double imbalance = 0;  ///< force out of balance relative to the forces at work: at the end where a tolerance was
                           ///< asked for, else before the last linear solve
    double linear_residual = 0;  ///< of the last linear solve, relative to its right-hand side
    double forces_s = 0, operator_s = 0, solve_s = 0;
};

/// How far a step goes: `linearisations` at most, stopping early at `tolerance` (force out of balance relative to the
/// forces at work); each linear solve to `linear_tolerance`.
struct StepEffort {
    int linearisations = 1;
    double tolerance = 0;
    double linear_tolerance = 1e-3;
};

/// A deformable body with its constraints, loads and state of motion: M u'' + C u' + f_int(u) = f_ext with
/// C = alpha M + beta K, stepped by Newmark or implicit Euler, or brought to equilibrium.
class DeformableBody {
  public:
    /// Collective; see ElasticOperator.
    DeformableBody(MPI_Comm comm, const MeshHierarchy& hierarchy, std::span<const std::vector<std::int32_t>> parts,
                   std::span<const Material> materials, StrainModel strain, const TimeOptions& time,
                   const SolverOptions& options);

    /// Constraints of the finest mesh. What is constrained may change between steps; new values alone cost nothing.
    void set_constraints(const Constraints& constraints);
    /// External force at each node of the finest mesh, N.
    void set_external_force(std::span<const Vector3> force);

    /// One step of `dt` seconds (static: to equilibrium, dt unused). Always leaves a finite state: where the new one is
    /// not, the old one is kept and the report says converged = false.
    StepReport step(double dt, const StepEffort& effort);

    /// Displacement, m, of every node of the finest mesh, on every rank.
    std::vector<Vector3> displacement() const { return gather(operator_.fine().share(), u_.get()); }
    /// Elastic force at each node, N: at constrained nodes in equilibrium, the reaction.
    std::vector<Vector3> elastic_force();
    double strain_energy();
    double kinetic_energy();
    void set_velocity(std::span<const Vector3> velocity);

    ElasticOperator& elastic_operator() { return operator_; }

  private:
    PetscHandle<Vec> vector() const { return make_vector(operator_.fine().share()); }
    bool is_dynamic() const { return time_.scheme != TimeScheme::static_equilibrium; }
    void take_rotations();
    void start_acceleration();
    void prescribe_values();
    /// Fills residual_ = f_ext - f_int - C v1 - M a1, zero at constrained components; returns its norm and sets scale_.
    double evaluate_residual(const TimeCoefficients& c);
    double search_line(const TimeCoefficients& c, double norm);
    void finish_step(const TimeCoefficients& c, double dt);
    bool is_finite() const;

    TimeOptions time_;
    SolverOptions options_;
    ElasticOperator operator_;
    Constraints constraints_;
    PetscHandle<Vec> u_, u0_, v_, a_, du_, velocity_, residual_, force_, external_;
    bool started_ = false;
    double scale_ = 0;  ///< size of the forces at work, N
};

}  // namespace livetet
