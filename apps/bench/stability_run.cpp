#include "apps/bench/stability_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "apps/scene/model_limits.hpp"
#include "apps/simulation/scene_run.hpp"
#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "mechanics/rigid_motions.hpp"

namespace livetet {

namespace {

constexpr int settling_frames = 15;
constexpr int deadline_tries =
    3;  // what else the machine does makes frames late, and not twice the same
/// Of `solve`: many times what a step takes that goes well.
double longest_step_s(const StabilityCase& c) { return c.is_fine ? 600 : 60; }

/// What ends a trial: the rule that does not hold.
struct Broken {
    std::string rule;
    bool by_time = false;
};

template <class... Args>
[[noreturn]] void broken(fmt::format_string<Args...> format, Args&&... args) {
    throw Broken{fmt::format(format, std::forward<Args>(args)...)};
}

class Trial {
  public:
    Trial(const StabilityCase& c, const StabilityColumn& column, const MeshHierarchy& hierarchy,
          const StabilityLimits& limits, StabilityCell& cell)
        : case_(c),
          column_(column),
          limits_(limits),
          cell_(cell),
          scene_(scene_of(c, column, hierarchy.levels.front())),
          body_(make_body(PETSC_COMM_SELF, scene_, hierarchy,
                          is_tracked() ? Use::track : Use::solve)),
          held_(scene_, body_.mesh()),
          patch_(stability_patch(c, body_.mesh())),
          turns_(!free_rigid_motions(body_.mesh(), held_.constraints().components).empty()) {
        check_no_free_motion(scene_, body_.mesh(), held_);
        cell_.solver = body_.body->linear_solver().name();
    }

    void run() {
        DeformableBody& body = *body_.body;
        if (case_.start != StartState::rest)
            body.set_displacement(start_displacement(case_.start, body_.mesh()));
        look();
        until_now_ = energy_;
        const int steps =
            case_.driven_steps(is_tracked() ? limits_.noise_frames : limits_.noise_frames / 1000);
        if (steps > 0) {
            for (int k = 1; k <= steps; ++k) advance(k - 1, k, steps, case_.step_s);
            const int standing = is_tracked() ? settling_frames + 5 : 5;
            for (int k = 0; k < standing; ++k) {
                const bool settles = is_tracked() && k < settling_frames;
                advance(steps, steps, steps, case_.step_s, !settles);
            }
        }
        patch_.clear();
        if (is_static()) {
            for (int k = 0; k < (is_tracked() ? 60 : 2); ++k)
                advance(1, 1, 1, case_.step_s, !is_tracked() || k >= settling_frames);
        } else {
            for (int k = 0; k < 10; ++k) advance(1, 1, 1, case_.step_s, true);
            const double wanted = case_.period_s() / 8;
            for (double dt = case_.step_s; dt != wanted;) {
                dt = dt < wanted ? std::min(wanted, 2 * dt) : std::max(wanted, dt / 2);
                advance(1, 1, 1, dt, true);
            }
            for (int k = 0; k < 64; ++k) advance(1, 1, 1, wanted, true);
        }
        cell_.left = turns_ ? energy_ / std::max(until_now_, 1e-300)
                            : farthest_now_ / std::max(farthest_, 1e-300);
        const double allowed = is_static() ? 1e-3 : 0.02;
        if (cell_.left > allowed)
            broken("rest: {:.2g} % of the greatest {} is left at the end", 100 * cell_.left,
                   turns_ ? "energy" : "displacement");
        if (late_ > cell_.steps / 50 + 1)
            throw Broken{
                fmt::format(
                    "deadline: {} of {} frames took more than {:g} ms, in the last of {} tries",
                    late_, cell_.steps, 1e3 * limits_.budget_s, deadline_tries),
                true};
    }

  private:
    static Scene scene_of(const StabilityCase& c, const StabilityColumn& column,
                          const TetMesh& mesh) {
        Scene scene = stability_scene(c, column.strain, column.scheme, mesh);
        if (has_ten_nodes(column.way)) scene.elements = Elements::p2;
        if (is_plain(column.way)) scene.solver.kind = SolverKind::multigrid;
        if (is_of_hexahedra(column.way))
            scene.formulation =
                has_cell_pressures(column.way) ? Formulation::mixed : Formulation::displacement;
        return scene;
    }
    bool is_tracked() const { return makes_frames(column_.way); }
    bool is_static() const { return column_.scheme == TimeScheme::static_equilibrium; }

    /// The patch where it is at `place` of `steps`, on its way from step `from` to step `to` of
    /// them.
    Constraints constraints_at(int from, int to, int steps, double share) const {
        Constraints constraints = held_.constraints();
        for (const std::int32_t n : patch_) {
            const Vector3& x = body_.mesh().nodes[n];
            const Vector3 begin =
                from > 0 ? patch_displacement(case_, x, from, steps) : Vector3::Zero();
            constraints.prescribe(
                std::span(&n, 1),
                begin + share * (patch_displacement(case_, x, to, steps) - begin));
        }
        return constraints;
    }

    void advance(int from, int to, int steps, double dt, bool judged = false) {
        const auto move = [&](double share) {
            body_.body->set_constraints(constraints_at(from, to, steps, share));
        };
        if (is_tracked())
            frame(move, dt);
        else
            solve(move, dt);
        const double before = energy_;
        look();
        if (!judged) {
            until_now_ = std::max(until_now_, energy_);
            return;
        }
        if (!(until_now_ > 0)) return;
        cell_.energy_growth = std::max(cell_.energy_growth, energy_ / until_now_);
        const bool promises_less =
            !is_tracked() && (is_static() || column_.scheme == TimeScheme::implicit_euler);
        if (promises_less && energy_ > before + 0.01 * until_now_)
            broken(
                "energy: grows by {:.2g} of its greatest in step {}, where nothing moves the body",
                (energy_ - before) / until_now_, cell_.steps);
        if (energy_ > 2 * until_now_)
            broken("energy: {:.3g} times its greatest until the patch stood still, in step {}",
                   energy_ / until_now_, cell_.steps);
    }

    template <class Move>
    void solve(Move&& move, double dt) {
        StepReport last;
        ++cell_.steps;
        const auto start = Clock::now();
        const double reached =
            step_in_parts(*body_.body, dt, solve_controls(scene_), move,
                          [&](double share, double, const StepReport& report) {
                              cell_.newton_iterations += report.newton_iterations;
                              last = report;
                              const bool is_done = report.converged && share == 1;
                              if (!is_done && seconds_since(start) > longest_step_s(case_))
                                  broken(
                                      "solved: step {} is at {:.3g} of its way after {:g} s, where "
                                      "forces are out of balance by {:.1e}",
                                      cell_.steps, share, longest_step_s(case_), report.imbalance);
                          });
        if (reached < 1)
            broken(
                "solved: not beyond {:.3g} of step {}, where forces are out of balance by {:.1e} "
                "after {} Newton iterations",
                reached, cell_.steps, last.imbalance, last.newton_iterations);
    }

    template <class Move>
    void frame(Move&& move, double dt) {
        const auto start = Clock::now();
        move(1);
        const StepReport report = body_.body->advance(
            dt, {.newton_iterations = newton_iterations_,
                 .linear_tolerance = scene_.solver.relative_tolerance,
                 .deadline = Deadline::after(start, limits_.budget_s - tail_s_)});
        tail_s_ = std::max(0.95 * tail_s_,
                           report.finish_s);  // as `track` leaves time for what comes last
        late_ += seconds_since(start) > limits_.budget_s;
        ++cell_.steps;
        cell_.late = static_cast<double>(late_) / cell_.steps;
        cell_.newton_iterations += report.newton_iterations;
        if (report.kept_old) broken("finite: step {} came to no finite state", cell_.steps);
    }

    /// Takes energy and displacement, and judges whether they are finite.
    void look() {
        // Of a million frames of noise every thousandth is enough: a state that is lost stays lost.
        if (case_.motion == PatchMotion::noise && !patch_.empty() && cell_.steps % 1000 != 0 &&
            is_tracked() && cell_.steps < limits_.noise_frames)
            return;
        body_.body->displacement(u_);
        farthest_now_ = 0;
        for (const Vector3& u : u_)
            farthest_now_ =
                std::isfinite(u.squaredNorm()) ? std::max(farthest_now_, u.norm()) : INFINITY;
        energy_ = body_.body->strain_energy() + (is_static() ? 0 : body_.body->kinetic_energy());
        if (!(farthest_now_ < 1.5) || !std::isfinite(energy_))
            broken("finite: a node is {:.3g} m from its place at rest in step {}", farthest_now_,
                   cell_.steps);
        farthest_ = std::max(farthest_, farthest_now_);
    }

    const StabilityCase& case_;
    const StabilityColumn& column_;
    const StabilityLimits& limits_;
    StabilityCell& cell_;
    Scene scene_;
    const int newton_iterations_ = newton_iterations_of_frame(scene_);
    SceneBody body_;
    SceneConstraints held_;
    std::vector<std::int32_t> patch_;
    bool turns_;  ///< nothing holds it from turning as a rigid body
    std::vector<Vector3> u_;
    double energy_ = 0, until_now_ = 0;       ///< J: now; the greatest until the patch stood still
    double farthest_now_ = 0, farthest_ = 0;  ///< m
    int late_ = 0;
    double tail_s_ = 0;
};

/// `by_time`: whether it is the deadline alone that it failed.
StabilityCell run_once(const StabilityCase& c, const StabilityColumn& column,
                       const MeshHierarchy& hierarchy, const StabilityLimits& limits,
                       bool& by_time) {
    StabilityCell cell;
    by_time = false;
    const auto start = Clock::now();
    try {
        Trial(c, column, hierarchy, limits, cell).run();
    } catch (const Broken& b) {
        by_time = b.by_time;
        cell.verdict = Verdict::fail;
        cell.reason = b.rule;
    } catch (const Error& error) {
        cell.verdict = Verdict::refused;
        cell.reason = error.what();
    } catch (const std::exception& error) {  // what no rule foresees
        cell.verdict = Verdict::fail;
        cell.reason = fmt::format("ended: {}", error.what());
    }
    cell.seconds = seconds_since(start);
    return cell;
}

}  // namespace

StabilityCell run_stability(const StabilityCase& c, const StabilityColumn& column,
                            const MeshHierarchy& hierarchy, const StabilityLimits& limits) {
    StabilityCell cell;
    const bool takes_long = c.is_fine && (column.way != SteppedAs::solve ||
                                          column.scheme != TimeScheme::static_equilibrium);
    const bool cannot_be = is_of_hexahedra(column.way) && c.is_of_tets();
    if (takes_long || cannot_be) {
        cell.verdict = Verdict::left_out;
        return cell;
    }
    bool by_time = true;
    for (int k = 0; by_time && k < deadline_tries; ++k)
        cell = run_once(c, column, hierarchy, limits, by_time);
    return cell;
}

}  // namespace livetet
