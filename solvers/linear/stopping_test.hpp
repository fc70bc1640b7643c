#pragma once

#include "solvers/linear/linear_solver.hpp"

namespace livetet {

/// Whether a solve measures its iterations' steps to estimate the error of x.
enum class ErrorEstimate { none, from_steps };

/// Whether a solve, its residual reduced to `reduction` after so many iterations, would take far
/// more than 40 iterations to 1e-8: from the tenth on, its residual is more than 100 times that of
/// such a solve at an even pace. CG's residual may grow at first. Geometric multigrid takes 8 to 27
/// iterations where its coarse meshes fit the body.
bool is_too_slow(int iterations, double reduction);

/// Decides after each iteration of a Krylov solver whether to go on. PETSc's own test knows no
/// deadline, and no tolerance relative to the right-hand side before a start was subtracted from
/// it. If `begin` was not called (SNES runs the KSP), the tolerances of the KSP hold, as in PETSc's
/// own test.
class StoppingTest {
  public:
    /// `team` must outlive this.
    StoppingTest(ThreadTeam& team, ErrorEstimate estimate) : team_(team), estimate_(estimate) {}

    /// Makes it the test of `ksp`, unless PETSc's options name another (-ksp_convergence_test).
    void install(KSP ksp);
    /// `negative`: whether an operator's product showed negative curvature, set from outside; reset
    /// as a solve begins, and the solve ends where it is set. (KSPCG does not see it in its first
    /// iteration.)
    void watch_curvature(bool* negative) { negative_ = negative; }
    bool is_curved_down() const { return negative_ && *negative_; }
    /// Whether solves without a deadline end as KSP_DIVERGED_BREAKDOWN where `is_too_slow`; until
    /// the first that reduces its residual by two digits and converges.
    void watch(bool watched) { watched_ = watched; }
    /// Before a solve: to a residual of `allowed_residual`, N, and not beyond what `controls` say.
    void begin(const LinearControls& controls, double allowed_residual);
    /// The next solve goes on with the one before, which took so many iterations: to the same
    /// residual.
    void resume(int iterations);
    /// Whether to go on after an iteration (0: before the first) that left this residual, N, and
    /// whose step had this length, m, RMS over the nodes (0 where it is not measured).
    KSPConvergedReason judge(int iteration, double residual, double step);
    /// After it: the error of x, m, RMS over the nodes: what further steps would add up to, each
    /// shorter than the one before by the same ratio, a running mean. 0 where it is not estimated.
    double end();

  private:
    KSPConvergedReason reason(KSP ksp, int iteration, double residual);
    /// Length of the last step, m, RMS over the nodes.
    double measure_step(KSP ksp);

    ThreadTeam& team_;
    ErrorEstimate estimate_;
    bool begun_ = false, resumed_ = false, watched_ = false;
    LinearControls controls_;
    double allowed_ = 0;         ///< N
    double first_ = 0;           ///< residual before the first iteration, N
    PetscHandle<Vec> previous_;  ///< x after the iteration before
    double steps_[2] = {0, 0};   ///< lengths of the last two steps, m, RMS over the nodes
    double ratio_ = 0.3;         ///< of a step to the one before it: a running mean
    Clock::time_point last_;     ///< when the last iteration ended
    bool* negative_ = nullptr;
};

}  // namespace livetet
