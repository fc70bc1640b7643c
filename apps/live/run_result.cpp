#include "apps/live/run_result.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "apps/live/recorder.hpp"
#include "apps/live/statement_record.hpp"
#include "base/error.hpp"
#include "geometry/matrix_rows.hpp"
#include "io/result_file.hpp"
#include "tracking/live_registration.hpp"

namespace livetet {

namespace {

/// `names`: the values that the file holds.
RunFrame read_frame(const ResultReader& reader, const std::vector<std::string>& names,
                    std::size_t k, const std::string& source) {
    const auto value = [&](const char* name) { return reader.values(name, k, 1)[0]; };
    const auto value_if_any = [&](const char* name) -> std::optional<double> {
        if (std::find(names.begin(), names.end(), name) == names.end()) return {};
        return value(name);
    };
    const auto is = [&](RegistrationStatus status) {
        return value("registration_status") == static_cast<double>(status);
    };
    RunFrame frame;
    frame.time_s = reader.times_s()[k];
    const std::vector<double> pose = reader.values("tracker_from_image", k, 12);
    frame.tracker_from_image = transform_of_rows<Tracker, ImageFrame>(std::span(pose).first<12>());
    frame.frame_ms = value("frame_ms");
    frame.operator_ms = value("operator_ms");
    frame.forces_ms = value("forces_ms");
    frame.solve_ms = value("solve_ms");
    frame.sensor_ms = value_if_any("sensor_ms");
    frame.finish_ms = value_if_any("finish_ms");
    frame.output_ms = value_if_any("output_ms");
    frame.statement_ms = value_if_any("statement_ms");
    if (const auto ahead_s = value_if_any("ahead_s")) frame.ahead_ms = 1e3 * *ahead_s;
    frame.iterations = static_cast<int>(value("iterations"));
    frame.residual = value("residual");
    frame.error_estimate_mm = value_if_any("error_estimate_mm");
    frame.cut_short = value_if_any("cut_short").value_or(0) != 0;
    frame.press_mm = value("press_mm");
    frame.registration_held = is(RegistrationStatus::held);
    frame.registration_lost = is(RegistrationStatus::lost);
    frame.converged = value("converged") != 0;
    frame.turned_elements = value_if_any("turned_elements").value_or(0);
    if (std::find(names.begin(), names.end(), "sensors") != names.end()) {
        const std::vector<double> counts = reader.values("sensors", k, 6);
        std::copy_n(counts.begin(), 6, frame.sensors.emplace().begin());
    }
    frame.slipped = read_slipped(reader, k, source);
    return frame;
}

/// See read_run_result. Marks nothing if the press is below 1 mm.
void mark_nodes(RunResult& result) {
    const auto deepest = std::max_element(
        result.frames.begin(), result.frames.end(),
        [](const RunFrame& a, const RunFrame& b) { return a.press_mm < b.press_mm; });
    if (deepest->press_mm < 1) return;
    const std::vector<Vector3> u =
        result.displacement(static_cast<std::size_t>(deepest - result.frames.begin()));
    std::vector<std::int32_t> fixed, patch;
    for (const std::int32_t n : nodes_of(boundary_triangles(result.mesh.tets))) {
        if (u[n].isZero(0)) fixed.push_back(n);
        if (std::abs(1e3 * u[n].norm() - deepest->press_mm) < 1e-4) patch.push_back(n);
    }
    result.mesh.node_sets.try_emplace("fixed", std::move(fixed));
    result.mesh.node_sets.try_emplace("patch", std::move(patch));
}

/// Reconstructs the description that a killed program could not write.
RunInfo killed_run(const RunResult& result) {
    RunInfo info;
    info.samples = info.frames = result.frames.size();
    info.tets = result.mesh.tets.size();
    info.nodes = result.mesh.nodes.size();
    info.problem = "the program was killed; these are the frames until a few seconds before";
    return info;
}

}  // namespace

RunResult read_run_result(std::shared_ptr<const ResultReader> reader,
                          const std::filesystem::path& path) {
    RunResult result;
    result.source = path.string();
    result.scene_text = reader->scene_text();
    result.mesh = reader->mesh();
    if (reader->frame_count() == 0)
        fail("{}: holds no frame, expected the result of livetet track", result.source);
    const std::vector<std::string> names = reader->value_names();
    if (std::find(names.begin(), names.end(), "tracker_from_image") == names.end())
        fail("{}: holds no tracked poses, expected the result of livetet track", result.source);
    const StatementReader statements(*reader, result.source);
    result.targets = statements.names();
    for (std::size_t k = 0; k < reader->frame_count(); ++k) {
        result.frames.push_back(read_frame(*reader, names, k, result.source));
        result.frames.back().statement = statements.read(k);
    }
    result.info = reader->has_text("run") ? parse_run_info(reader->text("run"), result.source)
                                          : killed_run(result);
    result.displacement = [reader](std::size_t k) { return reader->displacement(k); };
    result.first_mesh = [reader] { return reader->first_mesh(); };
    mark_nodes(result);
    return result;
}

}  // namespace livetet
