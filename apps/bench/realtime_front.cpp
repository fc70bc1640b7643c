#include "apps/bench/realtime_front.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/bench/accuracy_run.hpp"
#include "apps/bench/accuracy_truth.hpp"
#include "apps/bench/distribution_table.hpp"
#include "apps/bench/follower.hpp"
#include "apps/bench/realtime_cases.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

constexpr double rate = 60, press = 0.015;

struct FrontMesh {
    Elements elements;
    std::int64_t tets;
};
constexpr FrontMesh meshes[] = {{Elements::p1, 6000}, {Elements::p1, 20000}, {Elements::p1, 60000},
                                {Elements::p2, 2500}, {Elements::p2, 6000},  {Elements::p2, 15000}};

std::string name_of(Elements elements) { return elements == Elements::p1 ? "P1" : "P2"; }

Scene front_scene(Elements elements, const std::string& law, int threads) {
    Scene scene = phantom_scene(TimeScheme::static_equilibrium);
    scene.materials = {{.young_Pa = 3000, .poisson = 0.45, .density_kg_per_m3 = 1060}};
    scene.elements = elements;
    scene.strain = std::string_view(law);
    scene.time.step_s = 1 / rate;
    scene.solver.threads = threads;
    scene.solver.relative_tolerance = 1e-9;  // iterations are given
    scene.track->smoothing_Hz = 0;           // the sensor has no noise
    scene.track->base_window_s = 0.1;
    return scene;
}

void take_times(FrontRow& row, const Measured& frame, std::vector<double>& seconds) {
    seconds.push_back(frame.seconds);
    row.forces_s += frame.step.forces_s;
    row.operator_s += frame.step.operator_s;
    row.solve_s += frame.step.solve_s;
}

/// Runs the frames of a row; times are of the frames from the first press on.
FrontRow measure_row(const FrontMesh& mesh, const std::string& law, int iterations,
                     const MeshHierarchy& hierarchy, const Truth& truth,
                     const FrontOptions& options) {
    SimulatedTrackerOptions tracker = bench_tracker();
    tracker.position_rms_mm = tracker.rotation_rms_deg = 0;
    const auto samples = record_press(tracker, rate, options.frames, press_depth, 0.2);
    const std::size_t first = samples.size() - options.frames;
    Follower follower(front_scene(mesh.elements, law, options.threads), hierarchy, tracker);
    const std::vector<std::size_t> judged = judged_targets(truth);
    std::vector<Vector3> places;
    for (const std::size_t i : judged) places.push_back(truth.targets[i].position);
    const PointSampler targets(follower.mesh(), places);
    FrontRow row{name_of(mesh.elements),       law,        follower.mesh().tets.size(),
                 follower.mesh().nodes.size(), iterations, {}};
    std::vector<double> seconds;
    double squares = 0, solver = 0, count = 0, solved = 0;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        const double depth = k < first ? 0 : press_depth(static_cast<double>(k - first) / rate);
        const bool is_judged = k >= first && (k - first) % 30 == 20;
        const Measured m =
            is_judged ? follower.judged_frame(samples[k], {.max_iterations = iterations}, 1 / rate)
                      : follower.frame(samples[k], {.max_iterations = iterations});
        if (k < first) continue;
        if (is_judged)
            solver += m.error * m.error, ++solved;
        else
            take_times(row, m, seconds);
        if (depth < press / 3) continue;
        const std::vector<Vector3> u = targets.sample(follower.body().displacement());
        for (std::size_t i = 0; i < judged.size(); ++i) {
            const double error =
                (u[i] - displacement_of(truth, truth.targets[judged[i]], depth)).norm();
            squares += error * error;
            row.worst = std::max(row.worst, error);
            ++count;
        }
    }
    for (double FrontRow::*stage : {&FrontRow::forces_s, &FrontRow::operator_s, &FrontRow::solve_s})
        row.*stage /= static_cast<double>(seconds.size());
    row.seconds = distribution(std::move(seconds));
    row.rms = std::sqrt(squares / count);
    row.solver = std::sqrt(solver / solved);
    return row;
}

}  // namespace

std::vector<FrontRow> measure_front(const FrontOptions& options, ProgressLine& progress) {
    const PhantomImages images = make_phantom_images(0.0015, 1);
    progress.update(0, "front: the truth");
    const PressedOrgan organ =
        press_organ(images, options.truth_tets, {0.0025, 0.005, 0.0075, 0.01, 0.0125, press},
                    progress.callback(), {.poisson = 0.45, .sharp_rim = true, .patch_edge = 0.002});
    std::vector<FrontRow> rows;
    double done = 0;
    for (const FrontMesh& mesh : meshes) {
        const MeshHierarchy hierarchy =
            mesh_phantom(images, {"", mesh.tets, 0, 0, 0}, progress.callback());
        for (const char* law : {"corotated", "neohookean"})
            for (const int iterations : {1, 3}) {
                progress.update(
                    0.2 + 0.8 * done / (std::size(meshes) * 4),
                    fmt::format("front: {}, {} tets, {}", name_of(mesh.elements), mesh.tets, law));
                rows.push_back(measure_row(mesh, law, iterations, hierarchy, organ.truth, options));
                ++done;
            }
    }
    return rows;
}

void print_front(const std::vector<FrontRow>& rows) {
    fmt::print("Whole error of a frame at the targets, press of 15 mm at 1 Hz, nu 0.45\n");
    fmt::print("{:<9}{:<12}{:>8}{:>8}{:>7} |{:>8}{:>8}{:>8}{:>9}{:>7} |{:>9}{:>10}{:>9}\n",
               "elements", "law", "tets", "nodes", "cycles", "median", "p99", "forces", "operator",
               "solve", "solver", "error mm", "% press");
    fmt::print("{:<44} |{:>8}{:>8}{:>8}{:>9}{:>7} |{:>9}\n", "", "ms", "ms", "ms", "ms", "ms",
               "mm");
    for (const FrontRow& r : rows)
        fmt::print(
            "{:<9}{:<12}{:>8}{:>8}{:>7} |{:>8.2f}{:>8.2f}{:>8.2f}{:>9.2f}{:>7.2f} |{:>9.4f}"
            "{:>10.3f}{:>9.1f}\n",
            r.elements, r.law, r.tets, r.nodes, r.iterations, 1e3 * r.seconds.median,
            1e3 * r.seconds.p99, 1e3 * r.forces_s, 1e3 * r.operator_s, 1e3 * r.solve_s,
            1e3 * r.solver, 1e3 * r.rms, 100 * r.rms / press);
    fmt::print("\n");
}

nlohmann::json json_of(const std::vector<FrontRow>& rows) {
    nlohmann::json list = nlohmann::json::array();
    for (const FrontRow& r : rows)
        list.push_back({{"elements", r.elements},
                        {"law", r.law},
                        {"tets", r.tets},
                        {"nodes", r.nodes},
                        {"iterations", r.iterations},
                        {"frame_s", json_of(r.seconds)},
                        {"forces_s", r.forces_s},
                        {"operator_s", r.operator_s},
                        {"solve_s", r.solve_s},
                        {"solver_error_m", r.solver},
                        {"error_rms_m", r.rms},
                        {"error_worst_m", r.worst}});
    return list;
}

WorkPrecisionChart chart_of(const std::vector<FrontRow>& rows) {
    WorkPrecisionChart chart{"whole error of a frame, press of 15 mm, nu = 0.45",
                             "error at the targets, % of the press",
                             {},
                             "median time of a frame, s"};
    for (const FrontRow& r : rows) {
        const std::string name = fmt::format("{} {}, {} iteration{}", r.elements, r.law,
                                             r.iterations, r.iterations == 1 ? "" : "s");
        auto line = std::find_if(chart.lines.begin(), chart.lines.end(),
                                 [&](const auto& l) { return l.name == name; });
        if (line == chart.lines.end()) line = chart.lines.insert(line, {name, {}, {}});
        line->seconds.push_back(r.seconds.median);
        line->error.push_back(100 * r.rms / press);
    }
    return chart;
}

}  // namespace livetet
