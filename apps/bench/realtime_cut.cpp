#include "apps/bench/realtime_cut.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <thread>

#include "apps/bench/distribution_table.hpp"
#include "apps/bench/stability_cases.hpp"
#include "apps/live/tracked_model.hpp"
#include "base/stopwatch.hpp"

namespace livetet {

namespace {

constexpr double interval_s = 1.0 / 15;
/// Frames in which the sensor is placed, before the first cut.
constexpr int rest_frames = 15;
constexpr int planes = 6, frames_a_plane = 12, frames_between = 6;
constexpr int frames_a_body = rest_frames + planes * (frames_a_plane + frames_between);

const Vector3 block(0.2, 0.1, 0.1);
const Vector3 sensor_place(0.186, 0.05, 0.1);

/// Levels of so many cells along the height, six tets each.
MeshHierarchy block_of_tets(std::initializer_list<int> all_cells) {
    std::vector<TetMesh> levels;
    for (const int cells : all_cells)
        levels.push_back(std::move(stability_mesh({}, cells).levels.front()));
    return make_hierarchy(std::move(levels), "block");
}

/// Of 60,000 hexahedra or tets of four nodes, or of 6,000 of ten.
MeshHierarchy block_of(const std::string& elements) {
    if (elements == "Q1") return stability_grid({}, 31);
    return elements == "P1" ? block_of_tets({17, 8, 4}) : block_of_tets({8, 4});
}

/// A block and its scene: what the blade cuts opens a second later.
struct CutBlock {
    MeshHierarchy hierarchy;
    Scene scene;

    CutBlock(const std::string& elements, int threads)
        : hierarchy(block_of(elements)),
          scene(stability_scene({}, ModelChoice("neohookean"), TimeScheme::newmark,
                                hierarchy.levels.front())) {
        if (elements == "P2") scene.elements = Elements::p2;
        scene.fix = {};
        scene.fix.emplace_back().half_space_mm = {0, 0, 0.01, 0, 0, 1};
        scene.time.rayleigh_alpha = 10;
        scene.time.rayleigh_beta = 0.01;
        scene.solver = {};
        scene.solver.kind = SolverKind::live;
        scene.solver.threads = threads;
        scene.solver.relative_tolerance = 0.01;
        scene.track.emplace();
        scene.track->base_window_s = 0.5;
        scene.track->cut_interval_s = 1;
        scene.track->smoothing_Hz = 0;
        ToolOptions& scalpel = scene.track->tools.emplace_back();
        scalpel.tool = "Scalpel";
        scalpel.blade_mm = {0, -55, 0, 0, 55, 0};
    }
};

/// Where the blade's middle is in a frame; none: out of view, between two planes.
std::optional<Vector3> blade_at(int frame) {
    const int turn = frame - rest_frames, period = frames_a_plane + frames_between;
    if (turn < 0 || turn % period >= frames_a_plane) return {};
    const double x = block.x() * (0.1337 + 0.12 * (turn / period));
    const double share = static_cast<double>(turn % period) / (frames_a_plane - 1);
    return Vector3(x, block.y() / 2, block.z() * (1.01 - 0.71 * share));
}

TrackerSample sample_at(int frame) {
    const double t = frame * interval_s;
    const double depth =
        frame < rest_frames ? 0 : 0.004 * (1 - std::cos(2 * std::numbers::pi * t / 2));
    const auto still = [](const Vector3& place) {
        return TrackedPose{Eigen::Matrix3d::Identity(), place, PoseStatus::ok};
    };
    const std::optional<Vector3> blade = blade_at(frame);
    return {t,
            {still(Vector3::Zero()), still(sensor_place - depth * Vector3::UnitZ()),
             blade ? still(*blade) : TrackedPose{}}};
}

class CutRun {
  public:
    CutRun(const CutBlock& block, Preparation preparation)
        : preparation_(preparation),
          model_(make_tracked_model(block.scene, block.hierarchy)),
          tracked_(track_model(block.scene, model_, tool_finder({"Reference", "Sensor", "Scalpel"}),
                               {}, {}, MisplacedSensor::refuse)) {}

    /// Waits for the sample's time and computes its frame; until then, cuts are prepared. Returns
    /// the time from then on, s.
    double frame(int k) {
        using std::chrono::duration_cast;
        const auto arrives =
            start_ + duration_cast<Clock::duration>(std::chrono::duration<double>(k * interval_s));
        if (preparation_ == Preparation::between_frames)
            tracked_.prepare_cut([&] { return Clock::now() >= arrives; });
        std::this_thread::sleep_until(arrives);
        tracked_.advance(sample_at(k), {.deadline = Deadline::after(arrives, cut_deadline_s)});
        return seconds_since(arrives);
    }
    const CutMesh* cut() const { return tracked_.last().cut.get(); }
    std::size_t openings() const { return cut() ? cut()->openings : 0; }

  private:
    Preparation preparation_;
    TrackedModel model_;
    TrackedBody tracked_;
    Clock::time_point start_ = Clock::now();
};

CutRow measure_row(const std::string& elements, Preparation preparation, int frames, int threads,
                   const std::function<void(double)>& progress) {
    const CutBlock block(elements, threads);
    CutRow row{.elements = elements, .preparation = preparation};
    row.cells = cell_count(block.hierarchy.levels.front());
    std::vector<double> all, opened;
    std::size_t parted = 0, cutting = 0;
    while (static_cast<int>(all.size()) < frames) {
        CutRun run(block, preparation);
        for (int k = 0; k < frames_a_body; ++k) {
            const std::size_t before = run.openings();
            const double seconds = run.frame(k);
            if (k < rest_frames) continue;
            all.push_back(seconds);
            cutting += blade_at(k).has_value();
            if (run.openings() > before) opened.push_back(seconds);
        }
        row.openings += run.openings();
        if (const CutMesh* cut = run.cut()) {
            parted += cut->parted;
            row.prepared_s = std::max(row.prepared_s, cut->prepared_s);
        }
        progress(static_cast<double>(all.size()) / frames);
    }
    row.faces_a_frame = static_cast<double>(parted) / static_cast<double>(cutting);
    row.late = static_cast<std::size_t>(
        std::ranges::count_if(all, [](double s) { return s > cut_deadline_s; }));
    row.all = distribution(std::move(all));
    row.opened = distribution(std::move(opened));
    return row;
}

const char* name_of(Preparation preparation) {
    return preparation == Preparation::between_frames ? "between frames" : "in a frame";
}

}  // namespace

std::vector<CutRow> measure_cuts(int frames, int threads, ProgressLine& progress) {
    std::vector<CutRow> rows;
    for (const char* elements : {"Q1", "P1", "P2"})
        for (const auto preparation : {Preparation::between_frames, Preparation::in_a_frame})
            rows.push_back(measure_row(elements, preparation, frames, threads, [&](double share) {
                progress.update((static_cast<double>(rows.size()) + std::min(share, 1.0)) / 6,
                                fmt::format("cut: {}, {}", elements, name_of(preparation)));
            }));
    return rows;
}

void print_cuts(const std::vector<CutRow>& rows) {
    constexpr const char* heads =
        "{:<8} {:<14} {:>6} {:>7} {:>8} {:>9} | {:>7} {:>7} {:>7} {:>7} {:>5} | {:>7} {:>7}\n";
    fmt::print(
        "A blade cuts; {:.0f} frames a second, {:.0f} ms for each. Opened: frames in which a cut "
        "opens\n",
        1 / interval_s, 1e3 * cut_deadline_s);
    fmt::print(fmt::runtime(heads), "elements", "prepared", "cells", "faces", "openings", "takes",
               "median", "p95", "p99", "worst", "late", "opened", "worst");
    fmt::print(fmt::runtime(heads), "", "", "", "a frame", "", "ms", "ms", "ms", "ms", "ms", "%",
               "ms", "ms");
    for (const CutRow& r : rows)
        fmt::print(
            "{:<8} {:<14} {:>6} {:>7.0f} {:>8} {:>9.0f} | {:>7.1f} {:>7.1f} {:>7.1f} {:>7.1f} "
            "{:>5.1f} | {:>7.1f} {:>7.1f}\n",
            r.elements, name_of(r.preparation), r.cells, r.faces_a_frame, r.openings,
            1e3 * r.prepared_s, 1e3 * r.all.median, 1e3 * r.all.p95, 1e3 * r.all.p99,
            1e3 * r.all.worst,
            100.0 * static_cast<double>(r.late) / static_cast<double>(r.all.count),
            1e3 * r.opened.median, 1e3 * r.opened.worst);
    for (std::size_t k = 0; k + 1 < rows.size(); k += 2)
        fmt::print("{}: a frame that opens a cut takes {:.2f} of one that prepares it, too\n",
                   rows[k].elements, rows[k].opened.median / rows[k + 1].opened.median);
    fmt::print("\n");
}

nlohmann::json json_of(const std::vector<CutRow>& rows) {
    nlohmann::json list = nlohmann::json::array();
    for (const CutRow& r : rows)
        list.push_back({{"elements", r.elements},
                        {"prepared", name_of(r.preparation)},
                        {"cells", r.cells},
                        {"faces_a_frame", r.faces_a_frame},
                        {"openings", r.openings},
                        {"prepared_s", r.prepared_s},
                        {"deadline_s", cut_deadline_s},
                        {"frame_s", json_of(r.all)},
                        {"opened_s", json_of(r.opened)},
                        {"late", r.late}});
    return list;
}

}  // namespace livetet
