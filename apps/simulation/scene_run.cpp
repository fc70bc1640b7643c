#include "apps/simulation/scene_run.hpp"

#include <algorithm>
#include <cmath>

#include "base/stopwatch.hpp"

namespace livetet {

namespace {

std::string progress_text(const StepRecord& step, std::size_t count) {
    return fmt::format(
        "step {} at {:.4g}: {} Newton iterations, {} Krylov iterations, imbalance {:.1e}{}", count,
        step.time_s, step.report.newton_iterations, step.report.iterations, step.report.imbalance,
        step.report.converged ? "" : ", NOT converged");
}

constexpr double min_part = 1.0 / 32;

/// How much longer the next part of a step may be, after one that took so many Newton iterations:
/// longer below eight of them, shorter beyond (Ramm 1981).
double growth_after(int newton_iterations) {
    constexpr double wanted = 8;
    return std::clamp(std::sqrt(wanted / std::max(1, newton_iterations)), 0.5, 2.0);
}

/// What the last Newton iteration did, unless it took the whole step along the exact direction.
std::string direction_text(const NewtonProgress& p) {
    const char* along = p.direction == NewtonDirection::truncated ? "to negative curvature"
                        : p.direction == NewtonDirection::positive
                            ? "with the tangent's positive part"
                            : "";
    if (p.step_length == 1) return *along ? fmt::format(" ({})", along) : "";
    return fmt::format(" ({}{}{:.2g} of the step)", along, *along ? ", " : "", p.step_length);
}

/// Whether the scene's time limit, counted from here on, has passed: by the first rank's clock, for
/// all. Collective. Empty without a limit.
std::function<bool()> time_limit(const Scene& scene, MPI_Comm comm) {
    if (!scene.solver.time_limit_s) return {};
    return [comm, start = std::chrono::steady_clock::now(), limit = *scene.solver.time_limit_s] {
        int is_up = seconds_since(start) > limit;
        MPI_Bcast(&is_up, 1, MPI_INT, 0, comm);
        return is_up != 0;
    };
}

bool is_up(const SolveControls& controls) { return controls.is_time_up && controls.is_time_up(); }

/// The scene's controls; each iteration is shown as progress of `what` at `fraction`.
SolveControls shown_controls(const Scene& scene, const RunHooks& hooks,
                             const std::function<bool()>& is_time_up, double fraction,
                             const std::string& what) {
    SolveControls controls = solve_controls(scene);
    controls.is_time_up = is_time_up;
    if (hooks.progress || hooks.iterated)
        controls.observe = [&hooks, fraction, what](const NewtonProgress& p) {
            if (hooks.iterated) hooks.iterated();
            if (!hooks.progress) return;
            hooks.progress(
                fraction, fmt::format("{}: Newton iteration {}, imbalance {:.1e}{}, "
                                      "Krylov iteration {}, residual {:.1e}",
                                      what, p.newton_iterations + 1, p.imbalance, direction_text(p),
                                      p.iterations, p.linear_residual));
        };
    return controls;
}

/// Why a static run ends before all of its load.
std::string no_equilibrium_text(const Scene& scene, const RunHistory& history,
                                const SolveControls& controls) {
    const std::string left =
        history.share > 0 ? fmt::format("the result holds the equilibrium at {:.4g}", history.share)
                          : "nothing is kept";
    const StepRecord& last = history.steps.back();
    if (is_up(controls))
        return fmt::format("the time limit of {:.4g} s passed on the way to {:.4g} of the load; {}",
                           *scene.solver.time_limit_s, last.time_s, left);
    return fmt::format(
        "no equilibrium was found beyond {:.4g} of the load: at {:.4g}, the imbalance of forces is "
        "{:.1e} after {} Newton iterations (allowed {:.1e}); {}",
        history.share, last.time_s, last.report.imbalance, last.report.newton_iterations,
        last.report.allowed_imbalance, left);
}

RunHistory run_static(const Scene& scene, DeformableBody& body, SceneConstraints& constraints,
                      std::span<const Vector3> forces, const RunHooks& hooks) {
    const auto load_to = [&](double share) {
        constraints.move_to_share(share);
        body.set_constraints(constraints.constraints());
        body.set_springs(constraints.springs());
        body.set_external_force(forces, share);
    };
    double kept = 0;  // load of the last frame; the body at rest is no frame
    std::size_t frames = 0;
    const auto keep = [&](double share) {
        if (hooks.keep) hooks.keep(frames++, share);
    };
    const double whole = 1.0 / scene.time.load_steps;
    const std::function<bool()> is_time_up =
        time_limit(scene, body.linear_solver().fine().share().comm);
    RunHistory history;
    history.share = 0;
    for (int planned = 1; planned <= scene.time.load_steps; ++planned) {
        const double begin = history.share;
        const std::string load_step =
            fmt::format("load step {} of {}", planned, scene.time.load_steps);
        if (hooks.progress) hooks.progress(begin, load_step);
        const SolveControls controls = shown_controls(scene, hooks, is_time_up, begin, load_step);
        const double reached = step_in_parts(
            body, 0, controls,
            [&](double share) { load_to(begin + share * (planned * whole - begin)); },
            [&](double share, double part, const StepReport& report) {
                history.steps.push_back({begin + share * (planned * whole - begin),
                                         part * (planned * whole - begin), report,
                                         report.converged});
                const StepRecord& tried = history.steps.back();
                if (hooks.progress)
                    hooks.progress(tried.time_s - (tried.report.converged ? 0 : tried.step_s),
                                   progress_text(tried, history.steps.size()));
            });
        history.share = begin + reached * (planned * whole - begin);
        if (reached < 1) {
            history.converged = false;
            history.failure = no_equilibrium_text(scene, history, controls);
            load_to(history.share);
            if (history.share > kept) keep(history.share);
            return history;
        }
        if (planned % scene.output.every == 0 || planned == scene.time.load_steps)
            keep(kept = history.share);
    }
    return history;
}

/// Chooses the lengths of adaptive steps so that the error of each, in m, is near `tolerance`.
struct StepLengthControl {
    double tolerance;
    double order;                   ///< order of a step's error in its length
    double min_step_s, max_step_s;  ///< limits of the length

    /// Whether a step of this length must be repeated with a shorter one.
    bool rejects(const StepReport& report, double step) const {
        return (!report.converged || report.time_error > 1.5 * tolerance) && step > min_step_s;
    }
    /// The length of the next step or, after a rejected one, of the repetition.
    double next(const StepReport& report, double step) const {
        const double factor =
            report.converged
                ? 0.9 * std::pow(tolerance / std::max(report.time_error, 1e-30), 1 / order)
                : 0.25;
        if (rejects(report, step)) return std::max(min_step_s, step * std::clamp(factor, 0.1, 0.7));
        return std::clamp(step * std::clamp(factor, 0.3, 2.0), min_step_s, max_step_s);
    }
};

/// Enters the outcome of the step of `step` seconds from `time`; whether the run can go on.
bool note_outcome(RunHistory& history, const StepReport& report, double time, double step) {
    history.converged = history.converged && report.converged;
    if (!report.converged && history.failure.empty())
        history.failure = fmt::format(
            "the step to {:.4g} s left an imbalance of forces of {:.1e} (allowed {:.1e})",
            time + step, report.imbalance, report.allowed_imbalance);
    if (report.kept_old)
        history.failure =
            fmt::format("the step to {:.4g} s reached no finite state; the run ends at {:.4g} s",
                        time + step, time);
    return !report.kept_old;
}

void note_time_limit(RunHistory& history, const Scene& scene, double time) {
    history.converged = false;
    history.failure = fmt::format(
        "the time limit of {:.4g} s passed; the run ends at {:.4g} s, expected {:.4g} s",
        *scene.solver.time_limit_s, time, scene.time.duration_s);
}

RunHistory run_dynamic(const Scene& scene, DeformableBody& body, SceneConstraints& constraints,
                       std::span<const Vector3> forces, const RunHooks& hooks) {
    body.set_external_force(forces);
    body.set_springs(constraints.springs());
    const double tolerance = scene.time.adaptive_tolerance_mm / 1e3, end = scene.time.duration_s;
    const StepLengthControl control{tolerance,
                                    scene.time.scheme == TimeScheme::implicit_euler ? 2.0 : 3.0,
                                    scene.time.step_s / 1000, 100 * scene.time.step_s};
    RunPlace place = hooks.start;
    RunHistory history;
    history.failure = place.failure;
    history.converged = history.failure.empty();
    const std::function<bool()> is_time_up =
        time_limit(scene, body.linear_solver().fine().share().comm);
    double& time = place.time_s;
    double& dt = place.step_s;
    if (dt == 0) dt = scene.time.step_s;
    while (time < end * (1 - 1e-9)) {
        if (is_time_up && is_time_up()) {
            note_time_limit(history, scene, time);
            return history;
        }
        // Fixed steps keep their length; the last two adaptive ones share what is left.
        const double left = end - time;
        const double step = dt >= left * (1 - 1e-9) ? left
                            : tolerance > 0 ? std::min(dt, std::max(left / 2, control.min_step_s))
                                            : dt;
        const auto move = [&](double share) {
            constraints.move_to_time(time + share * step);
            body.set_constraints(constraints.constraints());
            body.set_springs(constraints.springs());
        };
        const auto take = [&](double share, double part, const StepReport& report) {
            history.steps.push_back({time + share * step, part * step, report, report.converged});
        };
        double reached = 0;
        const std::string step_text = fmt::format("step to {:.4g} s", time + step);
        if (hooks.progress && place.steps == hooks.start.steps)
            hooks.progress(time / end, step_text);
        const SolveControls controls =
            shown_controls(scene, hooks, is_time_up, time / end, step_text);
        if (tolerance > 0)
            body.keep_state();
        else
            reached = step_in_parts(body, step, controls, move, take);
        if (reached < 1 && tolerance == 0 && is_up(controls)) continue;  // and so end
        if (reached < 1) {
            move(1);
            take(1, 1 - reached, body.solve((1 - reached) * step, controls));
            history.steps.back().kept = true;  // even if not converged
        }
        const StepReport& report = history.steps.back().report;
        if (tolerance > 0) {
            dt = control.next(report, step);
            if (control.rejects(report, step)) {
                body.return_to_kept_state();
                history.steps.back().kept = false;
                continue;
            }
        }
        if (!note_outcome(history, report, time, step)) return history;
        time += step;
        ++place.steps;
        if (hooks.progress)
            hooks.progress(std::min(1.0, time / end),
                           progress_text(history.steps.back(), place.steps));
        const bool last = time >= end * (1 - 1e-9);
        if (place.steps % scene.output.every == 0 || last) {
            if (hooks.keep) hooks.keep(place.frames, time);
            ++place.frames;
        }
        if (!hooks.checkpoint || last || scene.output.checkpoint_every == 0 ||
            place.steps % scene.output.checkpoint_every != 0)
            continue;
        place.failure = history.failure;
        hooks.checkpoint(place);
    }
    return history;
}

}  // namespace

double step_in_parts(
    DeformableBody& body, double dt, const SolveControls& controls,
    const std::function<void(double share)>& move,
    const std::function<void(double share, double part, const StepReport&)>& record) {
    body.keep_state();
    const int most_iterations = std::max(200, 4 * controls.max_newton);
    int iterations = 0;
    double reached = 0;
    for (double part = 1; reached < 1 - 1e-12;) {
        const double share = reached + part > 1 - 1e-12 ? 1 : reached + part;
        move(share);
        const StepReport report = body.solve((share - reached) * dt, controls);
        record(share, share - reached, report);
        iterations += report.newton_iterations;
        if (report.converged) {
            part = (share - reached) * growth_after(report.newton_iterations);
            reached = share;
            body.keep_state();
            continue;
        }
        body.return_to_kept_state();
        part = (share - reached) / 2;
        if (part < min_part || iterations >= most_iterations || is_up(controls)) return reached;
    }
    return 1;
}

RunHistory run_scene(const Scene& scene, DeformableBody& body, SceneConstraints& constraints,
                     std::span<const Vector3> forces, const RunHooks& hooks) {
    return scene.time.is_dynamic() ? run_dynamic(scene, body, constraints, forces, hooks)
                                   : run_static(scene, body, constraints, forces, hooks);
}

}  // namespace livetet
