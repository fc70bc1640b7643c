#include "apps/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "apps/scene/cuts.hpp"
#include "apps/scene/model_limits.hpp"
#include "base/error.hpp"
#include "config/yaml.hpp"
#include "mesh/hex_grid.hpp"

namespace livetet {

namespace {

/// Distribution of a value over the frames that have it.
Distribution distribution_of(const RunResult& result,
                             std::optional<double> (*value)(const RunFrame&)) {
    std::vector<double> values;
    for (const RunFrame& frame : result.frames)
        if (const std::optional<double> x = value(frame)) values.push_back(*x);
    return distribution(std::move(values));
}

FrameStatistics frame_statistics(const RunResult& result) {
    FrameStatistics s;
    s.kept = result.frames.size();
    for (const RunFrame& frame : result.frames) {
        s.over_budget += frame.frame_ms > result.info.budget_ms;
        s.cut_short += frame.cut_short;
        s.not_converged += !frame.converged;
        s.turned_over += frame.turned_elements > 0;
        s.registration_held += frame.registration_held;
        s.registration_lost += frame.registration_lost;
    }
    using Value = std::optional<double>;
    s.frame_ms = distribution_of(result, [](const RunFrame& f) -> Value { return f.frame_ms; });
    s.sensor_ms = distribution_of(result, [](const RunFrame& f) -> Value { return f.sensor_ms; });
    s.forces_ms = distribution_of(result, [](const RunFrame& f) -> Value { return f.forces_ms; });
    s.operator_ms =
        distribution_of(result, [](const RunFrame& f) -> Value { return f.operator_ms; });
    s.solve_ms = distribution_of(result, [](const RunFrame& f) -> Value { return f.solve_ms; });
    s.finish_ms = distribution_of(result, [](const RunFrame& f) -> Value { return f.finish_ms; });
    s.output_ms = distribution_of(result, [](const RunFrame& f) -> Value { return f.output_ms; });
    s.statement_ms =
        distribution_of(result, [](const RunFrame& f) -> Value { return f.statement_ms; });
    s.ahead_ms = distribution_of(
        result, [](const RunFrame& f) { return f.ahead_ms > 0.0 ? f.ahead_ms : Value{}; });
    s.iterations = distribution_of(result, [](const RunFrame& f) -> Value { return f.iterations; });
    s.error_estimate_mm =
        distribution_of(result, [](const RunFrame& f) -> Value { return f.error_estimate_mm; });
    return s;
}

/// The frame of the largest displacement, among that of the deepest press and some fifty others.
std::size_t frame_that_moves_most(const RunResult& result, std::size_t deepest) {
    const std::size_t last = result.frames.size() - 1, every = last / 50 + 1;
    std::vector<std::size_t> frames{deepest, last};
    for (std::size_t k = 0; k < last; k += every) frames.push_back(k);
    std::size_t found = deepest;
    double largest = -1;
    for (const std::size_t k : frames)
        for (const Vector3& u : result.displacement(k))
            if (u.norm() > largest) largest = u.norm(), found = k;
    return found;
}

/// Adds what the scene of the run says. Adds nothing if the scene has keys that this version does
/// not know.
void add_scene(Report& report, const RunResult& result) {
    report.scene_text = result.scene_text;
    report.parts = explain_run(result.scene_text, result.source, result.mesh.tets.size(),
                               result.info.levels, result.info.solver, Use::track);
    if (report.parts.empty()) return;
    if (result.mesh.has_hexahedra()) report.parts.clear();  // they are of tetrahedra
    const Scene scene = read_yaml<Scene>(result.scene_text, result.source);
    report.notes =
        beyond_model(scene, result.mesh,
                     result.displacement(frame_that_moves_most(result, report.deepest_frame)));
    if (!scene.cuts.empty())
        report.notes.push_back(
            fmt::format("Cuts of the scene: {}.", cuts_text(scene, result.first_mesh())));
    if (auto note = locking_note(scene)) report.notes.push_back(std::move(*note));
    if (auto note = swinging_note(scene, result.mesh)) report.notes.push_back(std::move(*note));
    report.prepares_cuts = !scene.track || scene.track->pace != Pace::every_sample;
    if (scene.track)
        for (const SensorOptions& s : scene.track->sensors)
            report.sensors.push_back(
                {s.tool, s.patch_radius_mm, s.motion == DriveMotion::rigid, s.stiffness_N_per_m});
}

}  // namespace

Report make_report(const RunResult& result, const Truth* truth) {
    if (result.frames.empty()) fail("{}: holds no frame, expected at least one", result.source);
    const auto deepest = std::max_element(
        result.frames.begin(), result.frames.end(),
        [](const RunFrame& a, const RunFrame& b) { return a.press_mm < b.press_mm; });
    Report report;
    report.source = result.source;
    report.run = result.info;
    report.elements = elements_text(result.mesh);
    report.frames = frame_statistics(result);
    report.first_s = result.frames.front().time_s;
    report.last_s = result.frames.back().time_s;
    report.largest_press_mm = deepest->press_mm;
    report.deepest_frame = static_cast<std::size_t>(deepest - result.frames.begin());
    add_scene(report, result);
    for (const RunFrame& frame : result.frames)
        if (frame.sensors) {
            if (!report.sensor_frames) report.sensor_frames.emplace().fill(0);
            for (std::size_t s = 0; s < frame.sensors->size(); ++s)
                (*report.sensor_frames)[s] += (*frame.sensors)[s];
        }
    std::uint64_t before = 0;
    for (const RunFrame& frame : result.frames) {
        report.slips += static_cast<std::size_t>(std::popcount(frame.slipped & ~before));
        before = frame.slipped;
    }
    if (const auto& at_end = result.frames.back().sensors)
        report.unplaced = static_cast<std::size_t>((*at_end)[0]);
    if (truth) report.truth = compare_with_truth(result, *truth);
    report.stated = summarise_statements(result, report.truth ? &*report.truth : nullptr);
    return report;
}

}  // namespace livetet
