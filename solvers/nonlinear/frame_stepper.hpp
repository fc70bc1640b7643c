#pragma once

#include "solvers/nonlinear/deadline_reserve.hpp"
#include "solvers/nonlinear/force_balance.hpp"
#include "solvers/nonlinear/step_report.hpp"

namespace livetet {

/// How far a frame goes: this many Newton iterations with frozen rotations, each linear solve to
/// `linear_tolerance`, but not beyond `max_iterations` (none: as the solver's options say) nor,
/// after a first iteration, past the deadline.
struct FrameControls {
    int newton_iterations = 1;
    double linear_tolerance = 1e-3;
    std::optional<int> max_iterations{};
    std::optional<Deadline> deadline{};
    /// half: renew one half of the operator now and the other in the next frame, however far the
    /// deadline is; not soon after a jump. whole: renew a half only where time is short.
    RenewalExtent renewal = RenewalExtent::whole;
    /// Solves of a recorded frame to repeat bit for bit, without a deadline.
    const SolveRecords* as_done = nullptr;
};

/// Advances a body by frames that aim to end in time. A frame makes a fixed number of Newton
/// iterations; the first applies the prescribed increment, without a line search. Only where its
/// step leads far while no prescribed node moves, as when a body springs back from a shock, it
/// searches along the step and makes further iterations if that does not do. A deadline cuts linear
/// solves short, the earlier the more frames were late (DeadlineReserve). When time is short, only
/// one half of the operator is renewed. Running means of past frames decide whether it is, and
/// whether the direction that such an operator gives is used.
class FrameStepper {
  public:
    /// All must outlive this.
    FrameStepper(ForceBalance& balance, TimeIntegrator& time, PrescribedMotion& prescribed,
                 LinearSolver& solver, BodyState& state, const SolverOptions& options,
                 ThreadTeam& team);

    /// One frame from the state as it is, within a step that the TimeIntegrator has begun and whose
    /// prescribed increment was found. If the report says kept_old, the new state is not to be used
    /// (see ForceBalance::state_fault).
    StepReport advance(FrameControls controls);
    /// After the step has ended, with all its times in the report and whether it was late.
    void learn(const StepReport& report);
    /// Takes what another stepper has learned: that of the body that this one's replaces.
    void learn_from(const FrameStepper& other);

  private:
    LinearReport solve_linear(const FrameControls& controls, StepReport& report);
    struct Solved {
        LinearReport linear;
        RenewalExtent renewed;
    };
    Solved solve_once(const FrameControls& controls, const SolveRecord* done, Tangent tangent,
                      RenewalExtent wanted, StepReport& report);
    /// Whether a whole operator, one iteration and what follows would miss the deadline.
    bool is_late(const FrameControls& controls) const;
    /// Whether a node would move much farther than the prescribed ones usually do: there a full
    /// step of Newton's method may raise the energy, without bound from frame to frame.
    bool leads_far() const;
    /// Whether the result of an operator whose one half is a step old must be rejected: if tets
    /// have flipped since, the halves may not fit together.
    bool must_reject_partial_update(const LinearReport& linear) const;
    void watch_for_jump();
    /// Residuals after the body has moved; returns their norm.
    double evaluate_moved();
    double line_search(double norm_before);
    void move(double length);

    ForceBalance& balance_;
    TimeIntegrator& time_;
    PrescribedMotion& prescribed_;
    LinearSolver& solver_;
    BodyState& state_;
    const SolverOptions& options_;
    ThreadTeam& team_;
    PetscHandle<Vec> du_, dp_;
    DeadlineReserve reserve_;
    double renewal_s_ = 0;    ///< running mean: a whole operator
    double rest_s_ = 0;       ///< running mean: one iteration and what follows
    double moved_ = 0;        ///< largest prescribed increment of this step, m
    double usual_moved_ = 0;  ///< its running mean
    int settling_steps_ = 0;  ///< to come since the prescribed nodes jumped
};

}  // namespace livetet
