#pragma once

#include "solvers/nonlinear/force_balance.hpp"
#include "solvers/nonlinear/increment_history.hpp"
#include "solvers/nonlinear/step_report.hpp"

namespace livetet {

/// How far a frame goes: this many Newton iterations with frozen rotations, each linear solve to
/// `linear_tolerance`, but not beyond `iterations` (0: as the solver's options say) nor, after a
/// first iteration, past the deadline.
struct FrameControls {
    int newton_iterations = 1;
    double linear_tolerance = 1e-3;
    int iterations = 0;
    std::optional<Clock::time_point> deadline{};
    /// Renew one half of the operator now and the other in the next frame, however far the deadline
    /// is; not soon after a jump.
    bool by_halves = false;
    /// Solves of a recorded frame to repeat bit for bit, without a deadline.
    const SolveRecords* as_done = nullptr;
};

/// Advances a body by frames that aim to end in time. A frame makes a fixed number of Newton
/// iterations; the first applies the prescribed increment, without a line search. A deadline cuts
/// linear solves short. When time is short, only one half of the operator is renewed. Running means
/// of past frames decide whether it is, and whether the direction that such an operator gives is
/// used.
class FrameStepper {
  public:
    /// All must outlive this.
    FrameStepper(ForceBalance& balance, TimeIntegrator& time, PrescribedMotion& prescribed,
                 LinearSolver& solver, BodyState& state, IncrementHistory& history,
                 const SolverOptions& options, ThreadTeam& team);

    /// One frame from the state as it is, within a step that the TimeIntegrator has begun;
    /// `prescribed_size`: the largest component of the prescribed increment, m. Returns null, or
    /// why the new state is not to be used (see ForceBalance::state_fault).
    [[nodiscard]] const char* advance(double prescribed_size, const FrameControls& controls,
                                      StepReport& report);
    /// After the step has ended, with all its times in the report.
    void learn(const StepReport& report);

  private:
    LinearReport solve_linear(const FrameControls& controls, StepReport& report);
    struct Solved {
        LinearReport linear;
        bool by_half;  ///< only half of the operator was renewed
    };
    Solved solve_once(const FrameControls& controls, const SolveRecord* done, Tangent tangent,
                      bool by_halves, StepReport& report);
    /// Whether a whole operator, one iteration and what follows would miss the deadline.
    bool is_late(const FrameControls& controls) const;
    /// Whether the result of an operator whose one half is a step old must be rejected: if tets
    /// have flipped since, the halves may not fit together.
    bool must_reject_partial_update(const LinearReport& linear) const;
    /// Applies the solved increment, and in the first iteration the prescribed one; the residual's
    /// norm where a further iteration asks for it.
    double apply(bool first, double imbalance, bool last);
    void watch_for_jump(double prescribed_size);
    double line_search(double norm_before);
    void move(double length);

    ForceBalance& balance_;
    TimeIntegrator& time_;
    PrescribedMotion& prescribed_;
    LinearSolver& solver_;
    BodyState& state_;
    IncrementHistory& history_;
    const SolverOptions& options_;
    ThreadTeam& team_;
    PetscHandle<Vec> du_, dp_;
    double renewal_s_ = 0;    ///< running mean: a whole operator
    double rest_s_ = 0;       ///< running mean: one iteration and what follows
    double moved_ = 0;        ///< largest prescribed increment of this step, m
    double usual_moved_ = 0;  ///< its running mean
    int settling_steps_ = 0;  ///< to come since the prescribed nodes jumped
};

}  // namespace livetet
