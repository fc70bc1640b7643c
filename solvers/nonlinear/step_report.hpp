#pragma once

#include <array>
#include <optional>

#include "solvers/linear/linear_solver.hpp"

namespace livetet {

/// A frame solves at most this many linear systems where it must be repeatable to the bit.
constexpr int max_recorded_solves = 4;

/// What the clock decided in one linear solve of a frame.
struct SolveRecord {
    int iterations = 0;
    bool half_renewed = false;
};
using SolveRecords = std::array<SolveRecord, max_recorded_solves>;

/// Result of one step, one frame or one static solve. Times in seconds.
struct [[nodiscard]] StepReport {
    /// solve: Newton met its tolerance, or reached the round-off of the solver's precision (see
    /// `imbalance`). Frame: each linear solve met its own tolerance, or was cut short by a deadline
    /// or by a number of iterations that FrameControls gave.
    bool converged = true;
    bool cut_short = false;     ///< the deadline or the iterations allowed ended a linear solve
    bool late = false;          ///< frame: ended after its deadline
    bool half_renewed = false;  ///< the deadline left time for half of the operator
    bool kept_old = false;      ///< the new state was not usable and was dropped
    int newton_iterations = 0;
    int iterations = 0;            ///< of all linear solves
    SolveRecords solves{};         ///< of the first Newton iterations; frames only
    double imbalance = 0;          ///< residual relative to the forces at work: solve: at the end;
                                   ///< frame of one Newton iteration: before it
    double allowed_imbalance = 0;  ///< solve: what Newton had to meet: its tolerance, or round-off
                                   ///< where that is more
    double linear_residual = 0;    ///< of the last linear solve, relative to its right-hand side
    /// Frame: error of its last linear solve alone, m, RMS over the nodes, estimated. It has
    /// neither the error of linearisation nor that of discretisation, which can be 100 times
    /// larger. 0 where it is not estimated: with solvers other than live.
    double linear_error = 0;
    double time_error = 0;  ///< error of the displacement by the time step, m, about
    /// kept_old: why the new state was dropped. Else, in PETSc's words: solve: why Newton ended;
    /// frame: why its last linear solve ended, empty if it made none.
    const char* reason = "";
    double forces_s = 0, operator_s = 0, solve_s = 0;
    double preconditioner_s = 0;  ///< its set-up, where it has one apart from the operators
    double finish_s = 0;          ///< frame: what came after its last linear solve

    /// All stages together.
    double seconds() const { return forces_s + operator_s + preconditioner_s + solve_s + finish_s; }

    /// The new state is not usable, for this reason; the body takes up the old one.
    void drop(const char* why) {
        converged = false;
        kept_old = true;
        imbalance = 1;
        reason = why;
    }
};

}  // namespace livetet
