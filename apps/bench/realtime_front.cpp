#include "apps/bench/realtime_front.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/bench/accuracy_run.hpp"
#include "apps/bench/distribution_table.hpp"
#include "apps/bench/follower.hpp"
#include "apps/bench/front_organ.hpp"
#include "apps/bench/realtime_cases.hpp"
#include "apps/plots/pareto.hpp"
#include "image/mask_selection.hpp"
#include "mesh/quadratic.hpp"
#include "meshing/voxel_grid.hpp"

namespace livetet {

namespace {

constexpr double rate = 60, press = 0.015;

struct FrontMesh {
    Elements elements;
    std::int64_t cells;  ///< tets, or at most so many hexahedra
    bool graded = false, is_grid = false;
};
constexpr FrontMesh meshes[] = {{Elements::p1, 6000},
                                {Elements::p1, 20000},
                                {Elements::p1, 60000},
                                {Elements::p2, 2500},
                                {Elements::p2, 6000},
                                {Elements::p2, 15000},
                                {Elements::p1, 6000, true},
                                {Elements::p1, 20000, true},
                                {Elements::p2, 2500, true},
                                {Elements::p2, 6000, true},
                                {Elements::p2, 15000, true},
                                {Elements::p1, 4000, false, true},
                                {Elements::p1, 30000, false, true},
                                {Elements::p1, 60000, false, true}};

/// The phantom's voxels make no more cells; a larger grid needs finer ones.
constexpr std::int64_t most_cells_in_voxels = 30000;

std::string name_of(const FrontMesh& mesh) {
    return mesh.is_grid ? "Q1" : mesh.elements == Elements::p1 ? "P1" : "P2";
}
const char* name_of_mesh(bool graded) { return graded ? "graded" : "even"; }

/// The laws of a mesh's rows: the error of corotated frames is that of their law, which a finer
/// mesh does not reduce. The largest grid has small strain, too, which shows what the law costs.
std::vector<std::string> laws_on(const FrontMesh& mesh) {
    if (mesh.is_grid && mesh.cells > most_cells_in_voxels) return {"linear", "neohookean"};
    if (mesh.graded || mesh.is_grid) return {"neohookean"};
    return {"corotated", "neohookean"};
}

/// Of a mesh's rows. Pressures need more.
std::array<int, 2> iterations_of(bool is_mixed) {
    return is_mixed ? std::array{2, 4} : std::array{1, 3};
}

/// Graded at the patch that the truth presses.
MeshHierarchy front_mesh(const FrontMesh& mesh, const FrontOrgan& organ, const Truth& truth,
                         const ProgressCallback& progress) {
    const PhantomImages& images = organ.images;
    if (mesh.is_grid) {
        const PhantomImages& voxels =
            mesh.cells > most_cells_in_voxels && organ.finer ? *organ.finer : images;
        MeshHierarchy grid =
            make_hierarchy({voxel_grid(voxels.labels, {}, {}, mesh.cells).mesh}, organ.name);
        TetMesh& finest = grid.levels.front();
        finest.node_sets["fixed"] = nodes_in_mask(finest, images.fixed_mask);
        return grid;
    }
    PatchGrading grading;
    if (mesh.graded) grading.patches.push_back({truth.sensor_rest, truth.patch_radius});
    return mesh_phantom(images, {"", mesh.cells, 0, 0, 0}, progress, grading);
}

Scene front_scene(const FrontMesh& mesh, const std::string& law, const Truth& truth,
                  const FrontOptions& options) {
    Scene scene = phantom_scene(TimeScheme::static_equilibrium);
    scene.materials = {{.young_Pa = 3000, .poisson = options.poisson, .density_kg_per_m3 = 1060}};
    scene.elements = mesh.elements;
    scene.strain = std::string_view(law);
    scene.time.step_s = 1 / rate;
    scene.solver.threads = options.threads;
    scene.solver.relative_tolerance = 1e-9;  // iterations are given
    scene.track->smoothing_Hz = 0;           // the sensor has no noise
    scene.track->base_window_s = 0.1;
    if (mesh.graded) scene.track->sensors.front().place_mm = 1e3 * truth.sensor_rest;
    return scene;
}

/// A body that follows the press, and what its frames come to.
class FrontRun {
  public:
    FrontRun(const FrontMesh& mesh, const std::string& law, int iterations,
             const MeshHierarchy& hierarchy, const SimulatedTrackerOptions& tracker,
             const Truth& truth, const FrontOptions& options)
        : truth_(truth),
          limits_{.max_iterations = iterations},
          judged_(judged_targets(truth)),
          follower_(front_scene(mesh, law, truth, options), hierarchy, tracker),
          targets_(follower_.mesh(), places()),
          row_{.elements = name_of(mesh),
               .law = law,
               .graded = mesh.graded,
               .poisson = options.poisson,
               .cells =
                   mesh.is_grid ? follower_.mesh().hexahedra.size() : follower_.mesh().tets.size(),
               .nodes = follower_.mesh().nodes.size(),
               .iterations = iterations} {}

    void rest(const TrackerSample& sample) { (void)follower_.frame(sample, limits_); }

    /// A frame whose errors are taken, and where `judged` its distance from the converged one.
    void measured(const TrackerSample& sample, double depth, bool judged) {
        if (judged) {
            const Measured m = follower_.judged_frame(sample, limits_, 1 / rate);
            solver_ += m.error * m.error;
            ++solved_;
        } else {
            timed(sample);
        }
        if (depth < press / 3) return;
        const std::vector<Vector3> u = targets_.sample(follower_.body().displacement());
        for (std::size_t i = 0; i < judged_.size(); ++i) {
            const double error =
                (u[i] - displacement_of(truth_, truth_.targets[judged_[i]], depth)).norm();
            squares_ += error * error;
            row_.worst = std::max(row_.worst, error);
            ++count_;
        }
        if (depth > 0.999 * press)
            row_.volume_change = std::max(row_.volume_change, volume_change());
    }

    void timed(const TrackerSample& sample) {
        const Measured m = follower_.frame(sample, limits_);
        times_.push_back({m.seconds, m.cores});
        row_.forces_s += m.step.forces_s;
        row_.operator_s += m.step.operator_s;
        row_.solve_s += m.step.solve_s;
    }

    FrontRow row() {
        for (double FrontRow::*stage :
             {&FrontRow::forces_s, &FrontRow::operator_s, &FrontRow::solve_s})
            row_.*stage /= static_cast<double>(times_.size());
        row_.times = frame_times(times_);
        row_.rms = std::sqrt(squares_ / count_);
        row_.solver = std::sqrt(solver_ / solved_);
        return row_;
    }

  private:
    std::vector<Vector3> places() const {
        std::vector<Vector3> places;
        for (const std::size_t i : judged_) places.push_back(truth_.targets[i].position);
        return places;
    }

    /// |V / V0 - 1| of the body.
    double volume_change() {
        const TetMesh& mesh = follower_.mesh();
        const auto fields = follower_.body().tet_fields();
        double whole = 0, change = 0;
        for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
            const double share = mesh.shares.empty() ? 1 : mesh.shares[e / tets_per_hexahedron];
            const double part = share * signed_volume(mesh, mesh.tets[e]);
            whole += part;
            change += fields[e].volume_change * part;
        }
        return std::abs(change / whole);
    }

    const Truth& truth_;
    FrameLimits limits_;
    std::vector<std::size_t> judged_;
    Follower follower_;
    PointSampler targets_;
    FrontRow row_;
    std::vector<FrameSample> times_;
    double squares_ = 0, count_ = 0, solver_ = 0, solved_ = 0;
};

/// Runs the frames of a row: at rest, then those whose errors are taken, then those that are only
/// timed.
FrontRow measure_row(const FrontMesh& mesh, const std::string& law, int iterations,
                     const MeshHierarchy& hierarchy, const SimulatedTrackerOptions& tracker,
                     const Truth& truth, const FrontOptions& options) {
    // The frames between the judged ones are timed, too.
    const int timed = std::max(0, options.frames - options.error_frames * 29 / 30);
    const int pressed = options.error_frames + timed;
    const auto samples = record_press(tracker, rate, pressed, press_depth, 0.2);
    const std::size_t first = samples.size() - pressed;
    FrontRun run(mesh, law, iterations, hierarchy, tracker, truth, options);
    for (std::size_t k = 0; k < first; ++k) run.rest(samples[k]);
    for (int k = 0; k < pressed; ++k) {
        if (k < options.error_frames)
            run.measured(samples[first + k], press_depth(k / rate), k % 30 == 20);
        else
            run.timed(samples[first + k]);
    }
    return run.row();
}

}  // namespace

Front measure_front(const FrontOptions& options, ProgressLine& progress) {
    progress.update(0, "front: the organ");
    const FrontOrgan organ =
        options.organ.empty() ? phantom_front_organ()
                              : read_front_organ(options.organ, options.label, progress.callback());
    const Truth truth =
        press_front_organ(organ, options.truth_tets, options.poisson,
                          {0.0025, 0.005, 0.0075, 0.01, 0.0125, press}, progress.callback());
    const auto is_mixed = [&](const FrontMesh& mesh, const std::string& law) {
        const Scene scene = front_scene(mesh, law, truth, options);
        return resolved_formulation(elastic_model(scene)) == Formulation::mixed;
    };
    Front front{organ.name, {}};
    for (std::size_t k = 0; k < std::size(meshes); ++k) {
        const FrontMesh& mesh = meshes[k];
        const MeshHierarchy hierarchy = front_mesh(mesh, organ, truth, progress.callback());
        for (const std::string& law : laws_on(mesh))
            for (const int iterations : iterations_of(is_mixed(mesh, law))) {
                progress.update(0.2 + 0.8 * static_cast<double>(k) / std::size(meshes),
                                fmt::format("front: {}, {} cells, {}, {}", name_of(mesh),
                                            mesh.cells, name_of_mesh(mesh.graded), law));
                front.rows.push_back(
                    measure_row(mesh, law, iterations, hierarchy, organ.tracker, truth, options));
            }
    }
    mark_front(front.rows);
    return front;
}

void mark_front(std::vector<FrontRow>& rows) {
    std::vector<double> seconds, errors;
    for (FrontRow& r : rows) {
        r.on_front = false;
        seconds.push_back(r.times.all.median);
        errors.push_back(r.rms);
    }
    for (const std::size_t k : pareto_front(seconds, errors)) rows[k].on_front = true;
}

void print_front(const Front& front) {
    const std::vector<FrontRow>& rows = front.rows;
    constexpr const char* heads =
        "{:<5} {:<8} {:<10} {:<6} {:>6} {:>6} {:>6} | {:>6} {:>6} {:>6} | {:>6} {:>8} {:>9} | "
        "{:>6} {:>8} {:>6} | {:>7} {:>8} {:>7} {:>8}\n";
    if (rows.empty()) return;
    fmt::print("Whole error of a frame at the targets in {}, press of 15 mm at 1 Hz, nu {}\n",
               front.organ, rows.front().poisson);
    fmt::print(fmt::runtime(heads), "front", "elements", "law", "mesh", "cells", "nodes", "cycles",
               "median", "p99", "p99 *", "cpu", "switches", "steal", "forces", "operator", "solve",
               "solver", "error", "error", "volume");
    fmt::print(fmt::runtime(heads), "", "", "", "", "", "", "", "ms", "ms", "ms", "ms", "own+oth.",
               "s", "ms", "ms", "ms", "mm", "mm", "% press", "% off");
    std::size_t least = rows.front().times.all.count, fewest = least;
    for (const FrontRow& r : rows) {
        const FrameTimes& t = r.times;
        fmt::print(
            "{:<5} {:<8} {:<10} {:<6} {:>6} {:>6} {:>6} | {:>6.2f} {:>6.2f} {:>6} | {:>6.2f} {:>8} "
            "{:>9} | {:>6.2f} {:>8.2f} {:>6.2f} | {:>7.4f} {:>8.3f} {:>7.2f} {:>8.4f}\n",
            r.on_front ? "front" : "", r.elements, r.law, name_of_mesh(r.graded), r.cells, r.nodes,
            r.iterations, 1e3 * t.all.median, 1e3 * t.all.p99, p99_with_cores_text(t),
            1e3 * t.cpu_s, fmt::format("{}+{}", t.switched, t.others_switched),
            t.steal_s ? fmt::format("{:.2f}", *t.steal_s) : "not told", 1e3 * r.forces_s,
            1e3 * r.operator_s, 1e3 * r.solve_s, 1e3 * r.solver, 1e3 * r.rms, 100 * r.rms / press,
            100 * r.volume_change);
        least = std::min(least, t.all.count);
        fewest = std::min(fewest, t.with_cores.count);
    }
    fmt::print(
        "* of the frames that had their cores: no involuntary switch, no steal; at least {} of "
        "{}\n\n",
        fewest, least);
}

nlohmann::json json_of(const std::vector<FrontRow>& rows) {
    nlohmann::json list = nlohmann::json::array();
    for (const FrontRow& r : rows)
        list.push_back({{"elements", r.elements},
                        {"law", r.law},
                        {"mesh", name_of_mesh(r.graded)},
                        {"poisson", r.poisson},
                        {"cells", r.cells},
                        {"nodes", r.nodes},
                        {"iterations", r.iterations},
                        {"on_front", r.on_front},
                        {"frame_s", json_of(r.times.all)},
                        {"times", json_of(r.times)},
                        {"forces_s", r.forces_s},
                        {"operator_s", r.operator_s},
                        {"solve_s", r.solve_s},
                        {"solver_error_m", r.solver},
                        {"error_rms_m", r.rms},
                        {"error_worst_m", r.worst},
                        {"volume_change", r.volume_change}});
    return list;
}

WorkPrecisionChart chart_of(const Front& front) {
    const std::vector<FrontRow>& rows = front.rows;
    WorkPrecisionChart chart{fmt::format("whole error of a frame in {}, press of 15 mm, nu = {}",
                                         front.organ, rows.empty() ? 0 : rows.front().poisson),
                             "error at the targets, % of the press",
                             {},
                             "median time of a frame, s",
                             "front: nothing is both faster and nearer"};
    for (const FrontRow& r : rows) {
        const std::string kind =
            fmt::format("{} {}{}", r.elements, r.law, r.graded ? ", graded" : "");
        const std::string name =
            fmt::format("{}, {} iteration{}", kind, r.iterations, r.iterations == 1 ? "" : "s");
        auto line = std::find_if(chart.lines.begin(), chart.lines.end(),
                                 [&](const auto& l) { return l.name == name; });
        if (line == chart.lines.end()) line = chart.lines.insert(line, {name, {}, {}, kind});
        line->seconds.push_back(r.times.all.median);
        line->error.push_back(100 * r.rms / press);
    }
    return chart;
}

}  // namespace livetet
