#pragma once

#include <atomic>

#include "base/thread_team.hpp"
#include "mechanics/time_scheme.hpp"
#include "solvers/assembly/level_assembler.hpp"
#include "solvers/assembly/phase_timer.hpp"
#include "solvers/nonlinear/body_state.hpp"

namespace livetet {

/// Calls work(begin, end) on pieces of the components of a level's owned nodes, by all threads.
template <class Work>
void over_components(ThreadTeam& team, const LevelAssembler& level, Work&& work) {
    team.run_pieces(3 * static_cast<std::size_t>(level.share().owned), 3000,
                    std::forward<Work>(work));
}

/// largest = max(largest, value), from any thread; NaN stays.
void raise_to(std::atomic<double>& largest, double value);

/// What a time scheme adds to the balance of forces within one step, and how it ends the step.
/// With u0, v0, a0 at the step's start and u at its end, acceleration and velocity at its end are
/// affine in u (TimeCoefficients: Newmark, generalized-alpha, implicit Euler):
///
///     a1 = a_u (u - u0) - a_v v0 - a_a a0,    v1 = v_u (u - u0) + v_v v0 + v_a a0
///
/// Damping is C = alpha M + beta K. The static scheme has no mass and adds nothing. In order:
/// begin_step; anything else, as often as wanted, while u changes; finish_step or return_to_start.
class TimeIntegrator {
  public:
    /// Makes the state's vectors. Level, state and team must outlive this; a dynamic scheme's level
    /// has its mass before begin_step.
    TimeIntegrator(const TimeOptions& time, const LevelAssembler& level, BodyState& state,
                   ThreadTeam& team);

    /// Memory of velocities and accelerations on this rank.
    const PhaseCost& cost() const { return cost_; }
    bool is_dynamic() const { return time_.is_dynamic(); }
    double rayleigh_beta() const { return time_.rayleigh_beta; }
    const TimeCoefficients& coefficients() const { return c_; }
    /// The step's operator is stiffness_factor() K + mass_factor() M.
    double stiffness_factor() const;
    double mass_factor() const;

    /// Begins a step of `dt` seconds from the state as it is.
    void begin_step(double dt);
    /// u and p as they were at begin_step.
    void return_to_start();

    /// Sets velocity() to v1(u), m/s. Dynamic only, as what follows.
    void find_velocity();
    Vec velocity() const { return velocity_.get(); }
    /// force += M a1 and alpha M v1 as the scheme weighs them, N; find_velocity() was called at
    /// this u.
    void add_inertia(Vec force) const;
    /// force += M (a + alpha v) of the state as it is, N.
    void add_state_inertia(Vec force) const;
    /// Weight of h0 in the balance: alpha_f / (1 - alpha_f) with generalized-alpha, else 0.
    double history_weight() const { return state_.end_force ? c_.alpha_f / (1 - c_.alpha_f) : 0; }
    /// a0 from M a0 = f_ext - f_int(u0) - C v0: with a0 = 0 under loads the scheme would be of
    /// first order only. `force`: f_int + beta K v0 of owned nodes, N.
    void start_acceleration(Vec force, Vec external);
    /// Velocity and acceleration at the step's end; ghosts of u. Returns the displacement's error
    /// that the step made, m, about, the largest of all nodes. Collective.
    double finish_step(double dt);

  private:
    TimeOptions time_;
    const LevelAssembler& level_;
    BodyState& state_;
    ThreadTeam& team_;
    PhaseCost cost_;
    TimeCoefficients c_;
    PetscHandle<Vec> u0_, p0_;   ///< at the step's start
    PetscHandle<Vec> velocity_;  ///< v1
};

}  // namespace livetet
