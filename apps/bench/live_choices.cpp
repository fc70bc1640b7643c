#include "apps/bench/live_choices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/scene/body_factory.hpp"
#include "apps/scene/model_limits.hpp"
#include "apps/scene/scene_forces.hpp"
#include "apps/simulation/scene_run.hpp"
#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/surface_patch.hpp"
#include "solvers/linear/live_support.hpp"

namespace livetet {

namespace {

constexpr double frames_per_s = 60, largest_press = 0.015;
constexpr int warm_up_frames = 60;  // a press
/// Presses at which errors are taken: on the way in, where it is fastest, and at its deepest.
constexpr double judged_shares[] = {0.5, 1};

Scene at_equilibrium(const Scene& scene, Elements elements, SolverKind kind) {
    Scene s = scene;
    s.elements = elements;
    s.solver.kind = kind;
    s.time = {.scheme = TimeScheme::static_equilibrium, .step_s = 1 / frames_per_s};
    return s;
}

/// A body that a patch presses.
class PressedBody {
  public:
    PressedBody(const Scene& scene, MeshHierarchy hierarchy, Use use, const LivePress& press)
        : press_(press),
          body_(make_body(PETSC_COMM_SELF, scene, std::move(hierarchy), use)),
          held_(scene, body_.mesh()),
          patch_(surface_patch(body_.mesh(), press.place, press.radius).nodes),
          values_(patch_.size(), Vector3::Zero()) {
        Constraints constraints = held_.constraints();
        constraints.prescribe(patch_, Vector3::Zero());
        body_.body->set_constraints(constraints);
        body_.body->set_springs(held_.springs());
        body_.body->set_external_force(scene_forces(scene, body_.mesh()));
    }

    void press(double share) {
        std::fill(values_.begin(), values_.end(), share * press_.depth * press_.direction);
        body_.body->move_constraints(patch_, values_);
    }
    DeformableBody& body() { return *body_.body; }
    const TetMesh& mesh() const { return body_.mesh(); }

  private:
    LivePress press_;
    SceneBody body_;
    SceneConstraints held_;
    std::vector<std::int32_t> patch_;
    std::vector<Vector3> values_;
};

/// Displacements of the reference at the points, at each of the judged shares.
std::vector<std::vector<Vector3>> solve_reference(const Scene& scene,
                                                  const MeshHierarchy& hierarchy,
                                                  const LivePress& press,
                                                  const SamplePoints& points,
                                                  ProgressLine& progress) {
    Scene tight = at_equilibrium(scene, Elements::p2, SolverKind::automatic);
    tight.track.reset();
    PressedBody body(tight, hierarchy, Use::solve, press);
    const PointSampler sampler(body.mesh(), points.places);
    std::vector<std::vector<Vector3>> reached;
    double from = 0;
    for (const double to : judged_shares) {
        const double share = step_in_parts(
            body.body(), 0, {.tolerance = 1e-6, .linear_tolerance = 1e-2},
            [&](double part) { body.press(std::lerp(from, to, part)); },
            [&](double part, double, const StepReport&) {
                progress.update(0.3 * std::lerp(from, to, part),
                                "the reference: ten-node tets on the finest mesh");
            });
        if (share < 1)
            fail(
                "the reference of ten-node tets on the finest mesh did not converge beyond {:.2g} "
                "of a press of {:.1f} mm",
                std::lerp(from, to, share), 1e3 * press.depth);
        reached.push_back(sampler.sample(body.body().displacement()));
        from = to;
    }
    return reached;
}

/// Frames of one candidate.
class LiveRun {
  public:
    LiveRun(const Scene& scene, const MeshHierarchy& hierarchy, LiveCandidate& candidate,
            const LivePress& press, const SamplePoints& points)
        : candidate_(candidate),
          points_(points),
          body_(at_equilibrium(scene, candidate.elements, SolverKind::live),
                levels_from(hierarchy, candidate.level), Use::track, press),
          controls_{.newton_iterations = newton_iterations_of_frame(scene),
                    .linear_tolerance = scene.solver.relative_tolerance},
          sampler_(body_.mesh(), points.places, Outside::extrapolated),
          u_(body_.mesh().nodes.size()) {
        candidate_.tets = body_.mesh().tets.size();
        candidate_.nodes = body_.mesh().nodes.size();
    }

    void run(int frames, std::optional<double> budget_s,
             const std::vector<std::vector<Vector3>>& reference) {
        for (int k = 0; k < warm_up_frames + frames; ++k) {
            const double share = press_share(k / frames_per_s);
            const FrameSample frame = advance(share, budget_s);
            if (k < warm_up_frames) continue;
            times_.push_back(frame);
            for (std::size_t j = 0; j < std::size(judged_shares); ++j)
                if (std::abs(share - judged_shares[j]) < 1e-9) compare(reference[j]);
        }
        candidate_.times = frame_times(times_);
        candidate_.l2_m = volume_ > 0 ? std::sqrt(squares_ / volume_) : 0;
    }

  private:
    FrameSample advance(double share, std::optional<double> budget_s) {
        watch_.start();
        const auto start = Clock::now();
        controls_.deadline.reset();
        if (budget_s) controls_.deadline = Deadline::after(start, *budget_s);
        body_.press(share);
        (void)body_.body().advance(1 / frames_per_s, controls_);
        body_.body().displacement(u_);
        const double seconds = seconds_since(start);
        return {seconds, watch_.stop()};
    }

    void compare(const std::vector<Vector3>& reference) {
        const std::vector<Vector3> here = sampler_.sample(u_);
        for (std::size_t p = 0; p < points_.nodes(); ++p) {
            const double off = (here[p] - reference[p]).norm();
            candidate_.largest_m = std::isfinite(off) ? std::max(candidate_.largest_m, off) : off;
            squares_ += points_.volume[p] * off * off;
            volume_ += points_.volume[p];
        }
    }

    LiveCandidate& candidate_;
    const SamplePoints& points_;
    PressedBody body_;
    FrameControls controls_;
    PointSampler sampler_;
    CoreWatch watch_;
    std::vector<Vector3> u_;
    std::vector<FrameSample> times_;
    double squares_ = 0, volume_ = 0;
};

}  // namespace

double press_share(double t) { return (1 - std::cos(2 * std::numbers::pi * t)) / 2; }

MeshHierarchy levels_from(const MeshHierarchy& hierarchy, std::size_t level) {
    const auto from = static_cast<std::ptrdiff_t>(level);
    MeshHierarchy rest{{hierarchy.levels.begin() + from, hierarchy.levels.end()},
                       {hierarchy.transfers.begin() + from, hierarchy.transfers.end()},
                       hierarchy.provenance};
    if (hierarchy.parents.size() > level)
        rest.parents.assign(hierarchy.parents.begin() + from, hierarchy.parents.end());
    return rest;
}

LivePress live_press(const Scene& scene, const TetMesh& finest) {
    const SceneConstraints held(scene, finest);
    Vector3 fixed = Vector3::Zero(), all = Vector3::Zero();
    double fixed_count = 0;
    for (std::size_t n = 0; n < finest.nodes.size(); ++n) {
        all += finest.nodes[n] / static_cast<double>(finest.nodes.size());
        const bool is_held = held.constraints().components[n] != 0 ||
                             (!held.springs().empty() && held.springs().stiffness[n] > 0);
        if (!is_held) continue;
        fixed += finest.nodes[n];
        ++fixed_count;
    }
    if (fixed_count == 0) fail("the scene fixes no node, expected some to press the body against");
    fixed /= fixed_count;
    // Fixed all around: from below, as any side is as good.
    const Vector3 way =
        (all - fixed).norm() > 1e-6 ? (all - fixed).normalized() : Vector3(Vector3::UnitZ());
    Vector3 place = all;
    double best = -1e300;
    for (const std::int32_t n : nodes_of(boundary_triangles(finest.tets))) {
        const Vector3 x = finest.nodes[n] - all;
        const double along = x.dot(way), score = along - 3 * (x - along * way).norm();
        if (score <= best) continue;
        best = score;
        place = finest.nodes[n];
    }
    const double radius =
        1e-3 * (scene.track->sensors.empty() ? SensorOptions{} : scene.track->sensors.front())
                   .patch_radius_mm;
    return {place, -surface_patch(finest, place, radius).normal,
            std::min(largest_press, 0.15 * (place - fixed).norm()), radius};
}

std::string LiveCandidate::name() const {
    return fmt::format("level {}, {}", level, elements == Elements::p2 ? "P2" : "P1");
}

bool LiveCandidate::in_time(double seconds) const {
    return times.all.p99 <= seconds ||
           (times.can_judge_with_cores() && times.with_cores.p99 <= seconds);
}

const LiveCandidate* LiveChoices::cheapest(ErrorMeasure measure, double error_m,
                                           std::optional<double> frame_s) const {
    const LiveCandidate* best = nullptr;
    for (const LiveCandidate& c : measured)
        if (c.error_m(measure) <= error_m && (!frame_s || c.in_time(*frame_s)) &&
            (!best || c.times.all.median < best->times.all.median))
            best = &c;
    return best;
}

const LiveCandidate* LiveChoices::most_accurate(ErrorMeasure measure,
                                                std::optional<double> frame_s) const {
    const LiveCandidate* best = nullptr;
    for (const LiveCandidate& c : measured)
        if (std::isfinite(c.error_m(measure)) && (!frame_s || c.in_time(*frame_s)) &&
            (!best || c.error_m(measure) < best->error_m(measure)))
            best = &c;
    return best;
}

LiveChoices measure_live_choices(const Scene& scene, const MeshHierarchy& hierarchy, int frames,
                                 std::optional<double> budget_s, ProgressLine& progress) {
    if (!scene.track) fail("the scene has no track section, expected one");
    const TetMesh& finest = hierarchy.levels.front();
    LiveChoices choices{live_press(scene, finest)};
    std::vector<LiveCandidate> candidates;
    for (std::size_t l = 0; l < hierarchy.levels.size(); ++l)
        for (const Elements elements : {Elements::p1, Elements::p2}) {
            const LiveCandidate candidate{elements, l, 0, 0};
            if (l == 0 && elements == Elements::p2) continue;  // the reference's
            Scene own = scene;
            own.elements = elements;
            MeshHierarchy rest = levels_from(hierarchy, l);
            if (elements == Elements::p2) rest = with_quadratic_level(std::move(rest));
            const std::string reason = why_not_live(elastic_model(own), rest);
            if (reason.empty())
                candidates.push_back(candidate);
            else
                choices.left_out.push_back(candidate.name() + ": " + reason);
        }
    if (candidates.empty()) return choices;
    const SamplePoints points(finest, {});
    Stopwatch watch;
    const auto reference = solve_reference(scene, hierarchy, choices.press, points, progress);
    choices.reference_s = watch.lap();
    for (LiveCandidate& c : candidates) {
        progress.update(0.3 + 0.7 * static_cast<double>(choices.measured.size()) /
                                  static_cast<double>(candidates.size()),
                        c.name());
        LiveRun(scene, hierarchy, c, choices.press, points).run(frames, budget_s, reference);
        choices.measured.push_back(c);
    }
    return choices;
}

}  // namespace livetet
