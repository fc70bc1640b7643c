#include <fmt/format.h>

#include <numbers>

#include "apps/bench/allocation_count.hpp"
#include "apps/bench/follower.hpp"
#include "apps/bench/realtime_cases.hpp"
#include "apps/live/tracked_body.hpp"
#include "apps/phantom/phantom.hpp"
#include "apps/phantom/phantom_shape.hpp"
#include "base/stopwatch.hpp"
#include "image/mask_selection.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"
#include "tracking/poses.hpp"

namespace livetet {

using nlohmann::json;

MeshHierarchy mesh_phantom(const PhantomImages& images, const PhantomSize& size,
                           const ProgressCallback& progress, PatchGrading grading) {
    MeshingOptions options;
    options.grading = std::move(grading);
    options.target_tets = size.tets;
    options.target_tolerance = 0.03;
    MeshHierarchy hierarchy = std::move(
        build_hierarchy(surface_of_labels(images.labels, options).surface, options, progress)
            .hierarchy);
    hierarchy.levels.front().node_sets["fixed"] =
        nodes_in_mask(hierarchy.levels.front(), images.fixed_mask);
    return hierarchy;
}

Scene phantom_scene(TimeScheme scheme) {
    Scene scene;
    scene.fix.push_back({});
    scene.fix.back().group = "fixed";
    scene.time.scheme = scheme;
    if (scheme != TimeScheme::static_equilibrium) {
        scene.time.rayleigh_alpha = 10;
        scene.time.rayleigh_beta = 0.01;
    }
    scene.track = TrackOptions{};
    return scene;
}

namespace {

RenewalExtent extent_of(bool half) { return half ? RenewalExtent::half : RenewalExtent::whole; }

Scene phantom_scene(double nu, TimeScheme scheme, double rate, int threads) {
    Scene scene = phantom_scene(scheme);
    scene.materials = {{.young_Pa = 3000, .poisson = nu, .density_kg_per_m3 = 1060}};
    scene.time.step_s = 1 / rate;
    scene.solver.threads = threads;
    scene.track->base_window_s = 0.5;
    return scene;
}

/// A jump of 10 mm within a frame, without the filter, which would soften it; and the ten frames
/// after it.
json measure_jump(const Scene& pressed, const MeshHierarchy& hierarchy, double rate,
                  const FrameLimits& limits) {
    Scene scene = pressed;
    scene.track->smoothing_Hz = 0;
    SimulatedTrackerOptions tracker = bench_tracker();
    tracker.position_rms_mm = tracker.rotation_rms_deg = 0;
    constexpr int before = 5, after = 10;
    const auto samples = record_press(tracker, rate, before + after, [&](double t) {
        return t * rate < before - 0.5 ? 0.0 : 0.01;
    });
    Follower follower(scene, hierarchy, tracker);
    json errors = json::array();
    bool finite = true;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        const bool judged = k + after >= samples.size();
        const Measured m = judged ? follower.judged_frame(samples[k], limits, 1 / rate)
                                  : follower.frame(samples[k], limits);
        finite = finite && !m.step.kept_old && std::isfinite(m.error);
        if (judged) errors.push_back(m.error / 0.01);
    }
    return {{"error", errors}, {"finite", finite}};
}

struct FrameMethod {
    std::string name;
    SolverOptions solver;
    std::vector<int> iterations;  ///< one point each
};

}  // namespace

RealtimeResult measure_phantom(const PhantomSize& size, const MeshHierarchy& hierarchy, double nu,
                               TimeScheme scheme, const RealtimeArguments& arguments,
                               double bandwidth, ProgressLine& progress) {
    RealtimeResult result;
    result.name = size.name;
    result.motion = scheme == TimeScheme::static_equilibrium ? "static" : "newmark";
    result.nu = nu;
    result.bandwidth = bandwidth;
    result.target = {size.rate * (nu > 0.47 ? 0.5 : 1), size.mean_allowed, size.worst_allowed};
    const double rate = result.target.rate, budget = budget_within(1 / rate);
    const Scene scene = phantom_scene(nu, scheme, rate, arguments.threads);
    const SimulatedTrackerOptions tracker = bench_tracker();
    constexpr int warm_up = 20;
    const auto samples = record_press(tracker, rate, warm_up + arguments.frames, press_depth);
    const std::size_t first = samples.size() - arguments.frames;
    const int error_frames = std::min(arguments.frames, 1000);
    const std::size_t judged_to = first + error_frames;
    const std::string title = fmt::format("{} nu {} {}", size.name, nu, result.motion);

    // 1. times, frame by frame
    std::vector<FrameLimits> taken;
    {
        Follower follower(scene, hierarchy, tracker);
        result.tets = follower.mesh().tets.size();
        result.nodes = follower.mesh().nodes.size();
        result.threads = follower.body().threads();
        std::vector<Measured> frames;
        frames.reserve(samples.size());
        taken.reserve(judged_to);
        for (std::size_t k = 0; k < samples.size(); ++k) {
            if (k % 100 == 0)
                progress.update(0.5 * static_cast<double>(k) / samples.size(), title + ": times");
            const auto allocations = allocations_of_this_thread();
            const Measured m = follower.frame(samples[k], {}, budget);
            if (k < judged_to)
                taken.push_back({.max_iterations = std::max(1, m.step.solves[0].iterations),
                                 .renewal = extent_of(m.step.half_renewed)});
            if (k < first) continue;
            result.allocations += allocations_of_this_thread() - allocations;
            frames.push_back(m);
        }
        take_times(result, frames);
        result.bytes =
            bytes_of_frame(follower.body(), result.tets, result.nodes, result.cycles_mean, scheme);
    }
    // 2. errors: the same frames with the same number of iterations, some of them judged
    const auto every =
        static_cast<std::size_t>(std::max(1, error_frames / (size.tets > 100000 ? 25 : 50)));
    Follower follower(scene, hierarchy, tracker);
    std::vector<Measured> frames;
    for (std::size_t k = 0; k < judged_to; ++k) {
        const bool judged = k >= first && (k - first) % every == every / 2;
        if (judged)
            progress.update(0.5 + 0.5 * static_cast<double>(k) / judged_to, title + ": errors");
        frames.push_back(judged ? follower.judged_frame(samples[k], taken[k], 1 / rate)
                                : follower.frame(samples[k], taken[k]));
    }
    take_errors(result, frames);
    result.jump = measure_jump(
        scene, hierarchy, rate,
        {.max_iterations = std::max(1, static_cast<int>(std::lround(result.cycles_mean))),
         .renewal = extent_of(2 * result.half_renewed > result.times.all.count)});
    return result;
}

namespace {

std::vector<FrameMethod> frame_methods(int threads) {
    return {{"live", {.kind = SolverKind::live, .threads = threads}, {1, 2, 3, 5, 8}},
            {"live, one thread", {.kind = SolverKind::live, .threads = 1}, {1, 2, 3, 5, 8}},
            {"PCMG rediscretised",
             {.kind = SolverKind::multigrid, .finest = FinestOperator::assembled},
             {1, 2, 3, 5, 8}},
            {"PCMG Galerkin",
             {.kind = SolverKind::multigrid, .coarse = CoarseOperator::galerkin},
             {1, 2, 3, 5}},
            {"GAMG", {.kind = SolverKind::gamg}, {2, 8}},
            {"BoomerAMG", {.kind = SolverKind::boomeramg}, {2, 8}}};
}

}  // namespace

WorkPrecisionChart measure_methods(const PhantomSize& size, const MeshHierarchy& hierarchy,
                                   int threads, ProgressLine& progress) {
    const double rate = size.rate;
    WorkPrecisionChart chart{fmt::format("{}: {} tets, static, nu = 0.45, {:.0f} Hz", size.name,
                                         hierarchy.levels.front().tets.size(), rate),
                             "mean error of a frame, % of the largest displacement",
                             {}};
    const std::vector<FrameMethod> methods = frame_methods(threads);
    const SimulatedTrackerOptions tracker = bench_tracker();
    const auto scene_for = [&](const SolverOptions& solver) {
        Scene scene = phantom_scene(0.45, TimeScheme::static_equilibrium, rate, threads);
        scene.solver = solver;
        scene.solver.relative_tolerance = 1e-9;
        scene.solver.tangent = TangentChoice::frozen_rotation;
        scene.track->base_window_s = 0.08;
        return scene;
    };
    constexpr int frames = 16, every = 4;
    const auto samples = record_press(
        tracker, rate, frames + 1, [](double t) { return press_depth(t + 0.2); }, 0.1);
    const std::size_t pressed = samples.size() - frames - 1;  // at once, 0.2 s into the press

    // Equilibria have no history, so all methods are judged by the same ones.
    std::vector<std::vector<Vector3>> equilibria;
    {
        Follower follower(scene_for({.kind = SolverKind::live, .threads = threads}), hierarchy,
                          tracker);
        for (std::size_t k = 0; k < samples.size(); ++k) {
            if (k < pressed || (k - pressed) % every != 0) {
                (void)follower.frame(samples[k], {{}, 5});
                continue;
            }
            progress.update(static_cast<double>(k) / samples.size(),
                            "figure: " + size.name + ", equilibria");
            (void)follower.judged_frame(samples[k], {{}, 5}, 1 / rate);
            equilibria.push_back(follower.converged());
        }
    }
    double done = 0;
    for (const FrameMethod& method : methods) {
        WorkPrecisionLine line{method.name, {}, {}};
        const bool makes_hierarchies =
            method.solver.kind == SolverKind::gamg || method.solver.kind == SolverKind::boomeramg;
        const std::size_t last =
            makes_hierarchies ? pressed + every
                              : samples.size() - 1;  // set up in every frame, which takes seconds
        for (const int iterations : method.iterations) {
            progress.update(done, fmt::format("figure: {}, {}, {} iterations", size.name,
                                              method.name, iterations));
            Follower follower(scene_for(method.solver), hierarchy, tracker);
            std::vector<double> seconds;
            double error = 0, largest = 0, judged = 0;
            for (std::size_t k = 0; k <= last; ++k) {
                const Measured m = follower.frame(samples[k], {{}, iterations});
                if (k == pressed) follower.body().set_displacement(equilibria.front());
                if (k <= pressed) continue;
                seconds.push_back(m.seconds);
                if ((k - pressed) % every != 0) continue;
                const Gap gap =
                    gap_between(follower.body().displacement(), equilibria[(k - pressed) / every]);
                error += gap.rms;
                largest = std::max(largest, gap.largest);
                ++judged;
            }
            line.seconds.push_back(distribution(std::move(seconds)).median);
            line.error.push_back(100 * error / judged / largest);
            done += 1.0 / static_cast<double>(methods.size() * method.iterations.size());
        }
        chart.lines.push_back(std::move(line));
    }
    return chart;
}

}  // namespace livetet
