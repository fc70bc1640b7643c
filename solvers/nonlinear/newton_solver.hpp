#pragma once

#include <petscsnes.h>

#include <functional>
#include <optional>

#include "solvers/nonlinear/cell_pressures.hpp"
#include "solvers/nonlinear/force_balance.hpp"
#include "solvers/nonlinear/step_report.hpp"

namespace livetet {

/// What a Newton iteration goes along.
enum class NewtonDirection {
    exact,      ///< the solution of the exact tangent's system
    truncated,  ///< conjugate gradients until they met negative curvature of the exact tangent
    positive,   ///< the solution with the tangent's positive part
    frozen,     ///< the solution with frozen rotations
};

/// How far a nonlinear solve has come.
struct NewtonProgress {
    int newton_iterations = 0;
    NewtonDirection direction = NewtonDirection::exact;  ///< of the last iteration
    double step_length = 1;  ///< of the last iteration, relative to its direction
    double imbalance = 0;    ///< residual relative to the forces at work, after the last iteration
    int iterations = 0;      ///< of the linear solve under way
    double linear_residual = 0;  ///< of it, relative to its right-hand side
};

/// When a nonlinear solve ends: at a residual of `tolerance` relative to the forces at work, or
/// after `max_newton` iterations; each linear solve at `linear_tolerance`. Of PETSc's options
/// -snes_max_it and -ksp_rtol replace the last two; -snes_rtol, -snes_atol and -snes_stol can end a
/// solve before `tolerance` is met. Grids that use CellPressures may take up to
/// CellPressures::max_iterations before `max_newton` counts, and solve linear systems to at most
/// 1e-5 until then.
struct SolveControls {
    int max_newton = 50;
    double tolerance = 1e-8;
    double linear_tolerance = 1e-3;
    /// So many first iterations of SNES take the tangent as it was assembled last (the chord
    /// method), which must be near the present one: for a solve that begins where `linearise` was
    /// called.
    int old_tangents = 0;
    /// Called after each iteration of each linear solve; may be empty.
    std::function<void(const NewtonProgress&)> observe{};
    /// Asked before each Newton iteration but the first; may be empty. True: the solve ends, not
    /// converged. Must be the same on all ranks.
    std::function<bool()> is_time_up{};
};

/// Newton's method on a ForceBalance, by PETSc's SNES: all its options (-snes_type, -snes_monitor,
/// -snes_linesearch_type, -snes_ksp_ew, ...) work, without a prefix. Its unknown is the
/// displacement, in the mixed form displacement and scaled pressure; its function is (-r,
/// g).
///
/// If constrained nodes are to move, or if all the body's models are of small strain, a first
/// Newton iteration of our own comes before SNES, without a line search. It applies the prescribed
/// increment to first order, with forces at the old displacement, and its linear solve starts from
/// the last steps' increments. Any other step needs the line search from its first iteration on.
///
/// Also ours, unless the options say otherwise:
/// - Near its end Newton's iteration leaves about the residual of its linear solve. So a linear
///   solve that can end it aims at half of what is allowed, within a tenth of the right-hand side
///   and a tenth of its own tolerance (Eisenstat and Walker 1996).
/// - The tangent is the exact one. Where conjugate gradients meet negative curvature, what they
///   have found until then is the direction (truncated Newton: Nash 1985), and the line search
///   finds its length. If that is no direction of falling energy, if the linear solve fails in
///   another way, or if no length will do, this iteration and the next two take the tangent's
///   positive part.
/// - The full step is taken if it halves the residual. Else an EnergySearch finds the length: the
///   potential is that of elasticity, loads, springs, inertia and damping (all but the first are
///   affine in u, so that the trapezoidal rule integrates them exactly). In the mixed form, which
///   has a saddle point in place of a minimum, the slope of the monotone operator (dL/du, -dL/dp)
///   decides; see next_length.
/// - Grids of eight-node hexahedra in the mixed form use CellPressures, and the line search of the
///   mixed form. A solve that has not converged after CellPressures::max_iterations, as from a
///   crumpled start, starts again with eliminated pressures.
class NewtonSolver {
  public:
    /// All must outlive this.
    NewtonSolver(ForceBalance& balance, TimeIntegrator& time, PrescribedMotion& prescribed,
                 LinearSolver& solver, BodyState& state, const SolverOptions& options);

    /// Solves from the state as it is, within a step that the TimeIntegrator has begun and whose
    /// prescribed increment was found. The state is the last iterate, whatever the outcome; the
    /// report's kept_old says that it is not to be used.
    StepReport solve(const SolveControls& controls);

  private:
    void make_snes(MPI_Comm comm);
    void make_line_search();
    void solve_by_snes();
    /// Whether a step's first solve starts from those of steps before: load steps of a static body
    /// may differ in direction.
    bool goes_on() const { return time_.is_dynamic() || solver_.fine().is_linear(); }
    /// For a body that pressures_ can serve: begins their use, and keeps the state.
    void begin_pressures();
    /// Goes back to the state that was kept, with pressures eliminated from there on; returns its
    /// imbalance, N.
    double eliminate_pressures();
    /// Newton iterations from the state as it is, whose imbalance, N, this is.
    void iterate(double imbalance);
    /// The first iteration; whether it left a finite state.
    bool predict();
    bool is_time_up() const { return controls_.is_time_up && controls_.is_time_up(); }
    void set_tolerances();
    /// Of the linear solve at an imbalance of `residual`, N.
    double linear_tolerance(double residual) const;
    /// Has the linear solver's iterations call controls_.observe.
    void watch_linear_solver();
    void on_linear_iteration(int iteration, double residual);
    Tangent next_tangent();
    void copy_from_state();
    void copy_to_state(Vec x);
    // SNES's callbacks.
    void evaluate(Vec x, Vec f);
    void assemble(Vec x);
    SNESConvergedReason test(int iteration, double x_norm, double step_norm, double residual);
    void search_line(SNESLineSearch search);
    struct Line;
    /// Evaluates the trial state at this length of the line.
    void go_to(const Line& line, double length);
    /// The length to take, where the trial state then is; nothing if none will do. Both begin with
    /// the trial state at length 1.
    std::optional<double> search_by_energy(const Line& line, double slope);
    double search_by_slope(const Line& line, double slope);
    /// The length by pressures_, where the trial state then is.
    double search_by_pressures(const Line& line);
    std::optional<double> find_length(const Line& line);  ///< by one of these
    /// The operator and its preconditioner at the state.
    void assemble_operator();
    /// Whether a linear solve with the right-hand side f met the tolerance that was asked for, if
    /// not the tighter one that it was given, when its iterations ended.
    bool is_as_asked(KSP ksp, KSPConvergedReason reason, Vec f) const;
    /// Puts another direction where the exact tangent's failed; whether it changed it.
    bool mend_direction(Vec f, Vec direction);
    void take_positive_direction(Vec f, Vec direction);
    double slope(Vec f, Vec direction) const;

    ForceBalance& balance_;
    TimeIntegrator& time_;
    PrescribedMotion& prescribed_;
    LinearSolver& solver_;
    BodyState& state_;
    const SolverOptions& options_;
    SolveControls controls_;
    StepReport report_;  ///< of the solve under way
    NewtonProgress progress_;
    double first_residual_ = 0;  ///< N, of the linear solve under way
    PetscHandle<SNES> snes_;
    PetscHandle<Vec> x_, f_, du_, dp_;
    PetscHandle<Vec> start_;              ///< the displacement that pressures_ began at
    bool has_user_tests_ = false;         ///< -snes_rtol, -snes_atol or -snes_stol is given
    std::optional<PetscInt> user_limit_;  ///< by -snes_max_it
    bool searches_lines_ = true;          ///< by search_line, not by PETSc's
    Tangent tangent_ = Tangent::exact;
    int positive_steps_ = 0;     ///< iterations to come that take the positive tangent
    int iterations_before_ = 0;  ///< of the solve under way, until pressures were eliminated
    int old_tangents_ = 0;       ///< and that keep the tangent as it is
    CellPressures pressures_;    ///< of grids
    Vec along_ = nullptr;        ///< where a line is searched: its direction, for evaluate()
};

}  // namespace livetet
