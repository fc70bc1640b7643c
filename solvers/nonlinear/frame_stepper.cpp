#include "solvers/nonlinear/frame_stepper.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/stopwatch.hpp"
#include "solvers/nonlinear/line_search.hpp"

namespace livetet {

namespace {

/// The weight of the newest value in running means.
constexpr double newest = 0.2;

/// Time of a whole renewal divided by that of a half; both include coarse levels and shared tets.
constexpr double whole_over_half = 1.6;

/// The prescribed nodes have jumped if they move this many times as far as their running mean. The
/// steps_to_settle steps after a jump renew whole operators: after a large change of the rotations,
/// renewal by halves would oscillate.
constexpr double jump = 4;
constexpr int steps_to_settle = 10;

/// A step leads far if any node moves more than this many times the prescribed motion.
constexpr double max_reach = 8;

/// A frame that searched along its first step makes up to so many further Newton iterations ...
constexpr int further_iterations = 2;
/// ... if the residual is still larger than this part of the forces at work.
constexpr double lasting_imbalance = 0.5;

void renew_mean(double& mean, double value) { mean += newest * (value - mean); }

/// The end of the first of so many equal parts of the time that is left.
Deadline end_of_first(int parts, const Deadline& deadline) {
    return deadline.earlier_by(deadline.left_s() * (parts - 1) / parts);
}

}  // namespace

FrameStepper::FrameStepper(ForceBalance& balance, TimeIntegrator& time,
                           PrescribedMotion& prescribed, LinearSolver& solver, BodyState& state,
                           const SolverOptions& options, ThreadTeam& team)
    : balance_(balance),
      time_(time),
      prescribed_(prescribed),
      solver_(solver),
      state_(state),
      options_(options),
      team_(team) {}

void FrameStepper::watch_for_jump() {
    moved_ = prescribed_.increment_size();
    settling_steps_ =
        moved_ > jump * usual_moved_ ? steps_to_settle : std::max(0, settling_steps_ - 1);
    renew_mean(usual_moved_, moved_);
}

StepReport FrameStepper::advance(FrameControls controls) {
    if (controls.deadline) controls.deadline = reserve_.before(*controls.deadline);
    if (!du_) {
        du_ = solver_.fine().make_vector();
        if (state_.p) dp_ = solver_.fine().make_pressure_vector();
    }
    StepReport report;
    Stopwatch watch;
    watch_for_jump();
    const bool moves = moved_ != 0, at_once = solver_.fine().has_frozen_force();
    double imbalance = at_once && moves ? balance_.evaluate_with_prescribed() : balance_.evaluate();
    balance_.keep_scale();
    if (moves && !at_once) imbalance = balance_.subtract_prescribed();
    report.forces_s += watch.lap();
    const bool may_end_early =
        controls.deadline || controls.max_iterations || controls.as_done != nullptr;
    int iterations = controls.newton_iterations;
    for (int k = 0; k < iterations; ++k) {
        // A released body approaches rest: end before its forces become denormal numbers.
        if (imbalance <= balance_.negligible() && !(k == 0 && moves)) break;
        FrameControls of_solve = controls;
        if (controls.deadline) of_solve.deadline = end_of_first(iterations - k, *controls.deadline);
        const LinearReport linear = solve_linear(of_solve, report);
        watch.lap();
        report.converged =
            report.converged && (linear.converged || (linear.cut_short && may_end_early));
        report.linear_residual = imbalance > 0 ? linear.residual / imbalance : 0;
        ++report.newton_iterations;
        // Not while prescribed nodes move: the search would shorten what the tissue does, but not
        // what they do.
        const bool searches = k > 0 || (!moves && leads_far() && !solver_.fine().is_linear());
        if (k == 0) {
            solver_.keep_solve(du_.get());
            prescribed_.add_increment(state_.u.get());
        }
        if (searches) {
            imbalance = line_search(imbalance);
            if (k == 0 && imbalance > lasting_imbalance * balance_.scale())
                iterations = std::max(
                    iterations, std::min(iterations + further_iterations, max_recorded_solves));
        } else {
            move(1);
            // A frame of one iteration does not need the residual after it.
            if (iterations > 1) imbalance = evaluate_moved();
        }
        (searches || iterations > 1 ? report.forces_s : report.finish_s) += watch.lap();
        const char* fault = balance_.state_fault();
        if (!fault && !std::isfinite(imbalance)) fault = "the forces are not finite";
        if (fault) {
            report.drop(fault);
            return report;
        }
    }
    report.imbalance = balance_.scale() > 0 ? imbalance / balance_.scale() : 0;
    return report;
}

void FrameStepper::learn(const StepReport& report) {
    renew_mean(rest_s_, report.solve_s / std::max(1, report.iterations) + report.finish_s);
    reserve_.learn(report.late);
}

void FrameStepper::learn_from(const FrameStepper& other) {
    reserve_ = other.reserve_;
    renewal_s_ = other.renewal_s_;
    rest_s_ = other.rest_s_;
    usual_moved_ = other.usual_moved_;
    settling_steps_ = other.settling_steps_;
}

bool FrameStepper::is_late(const FrameControls& controls) const {
    return controls.deadline && renewal_s_ + rest_s_ > controls.deadline->left_s();
}

LinearReport FrameStepper::solve_linear(const FrameControls& controls, StepReport& report) {
    const SolveRecord* done = controls.as_done && report.newton_iterations < max_recorded_solves
                                  ? &(*controls.as_done)[report.newton_iterations]
                                  : nullptr;
    const bool half = done ? done->half_renewed
                           : settling_steps_ == 0 &&
                                 (controls.renewal == RenewalExtent::half || is_late(controls));
    const RenewalExtent wanted = half ? RenewalExtent::half : RenewalExtent::whole;
    const bool exact = options_.tangent == TangentChoice::exact;
    const Tangent tangent = exact ? Tangent::exact : Tangent::frozen_rotation;
    Solved solved = solve_once(controls, done, tangent, wanted, report);
    if (solved.renewed == RenewalExtent::half && !done &&
        must_reject_partial_update(solved.linear)) {
        report.half_renewed = false;
        solved = solve_once(controls, done, tangent, RenewalExtent::whole, report);
    }
    // If an exact tangent is not positive, the energy may rise along its direction.
    if (exact && !(solved.linear.converged && balance_.slope(du_.get(), dp_.get()) > 0))
        solved = solve_once(controls, done, Tangent::positive, RenewalExtent::whole, report);
    return solved.linear;
}

FrameStepper::Solved FrameStepper::solve_once(const FrameControls& controls,
                                              const SolveRecord* done, Tangent tangent,
                                              RenewalExtent wanted, StepReport& report) {
    Stopwatch watch;
    const RenewalExtent renewed = balance_.assemble(tangent, wanted);
    const bool half = renewed == RenewalExtent::half;
    const double assembly_s = watch.lap();
    report.half_renewed |= half;
    report.operator_s += assembly_s;
    const double whole_s = half ? whole_over_half * assembly_s : assembly_s;
    // A renewal after new constraints or a new time step takes longer, once.
    renew_mean(renewal_s_, renewal_s_ > 0 ? std::min(whole_s, 2 * renewal_s_) : whole_s);
    solver_.set_up_preconditioner();
    report.preconditioner_s += watch.lap();
    const int max_iterations = done ? std::max(done->iterations, 1)
                                    : controls.max_iterations.value_or(options_.max_iterations);
    const bool first = report.newton_iterations == 0;
    // With pressures the solve ends at the rounding of the forces, too: below it no iteration
    // helps.
    const double enough = state_.p ? balance_.allowed(0) : 0;
    const LinearReport linear =
        solver_.solve(balance_.residual(), balance_.volume_residual(), du_.get(), dp_.get(),
                      {controls.linear_tolerance, max_iterations, controls.deadline, enough},
                      first ? LinearStart::earlier_solves : LinearStart::zero);
    report.solve_s += watch.lap();
    report.iterations += linear.iterations;
    if (report.newton_iterations < max_recorded_solves)
        report.solves[report.newton_iterations] = {linear.iterations, half};
    report.cut_short |= linear.cut_short;
    report.linear_error = linear.error;
    report.reason = linear.reason;
    return {linear, renewed};
}

bool FrameStepper::leads_far() const {
    // VecNorm would allocate its cache at the first call; a frame allocates nothing.
    const ReadArray du(du_.get());
    std::atomic<double> largest{0};
    over_components(team_, solver_.fine(), [&](std::size_t begin, std::size_t end) {
        double of_piece = 0;
        for (std::size_t i = begin; i < end; ++i)
            if (const double d = std::abs(du[i]); !(d <= of_piece) && !std::isnan(of_piece))
                of_piece = d;
        raise_to(largest, of_piece);
    });
    return usual_moved_ > 0 && !(largest.load() <= max_reach * std::max(moved_, usual_moved_));
}

bool FrameStepper::must_reject_partial_update(const LinearReport& linear) const {
    return leads_far() || !(linear.residual <= balance_.residual_norm());
}

void FrameStepper::move(double length) {
    LIVETET_PETSC(VecAXPY(state_.u.get(), length, du_.get()));
    if (state_.p) LIVETET_PETSC(VecAXPY(state_.p.get(), length, dp_.get()));
}

double FrameStepper::evaluate_moved() {
    balance_.update_rotations();
    return balance_.evaluate();
}

double FrameStepper::line_search(double norm_before) {
    const double before = balance_.slope(du_.get(), dp_.get());
    double length = 1, taken = 0;
    for (int trial = 1;; ++trial) {
        move(length - taken);
        taken = length;
        const double norm_after = evaluate_moved();
        const auto next = next_length(before, balance_.slope(du_.get(), dp_.get()), norm_before,
                                      norm_after, length);
        if (!next || trial == max_line_search_trials) return norm_after;
        length = *next;
    }
}

}  // namespace livetet
