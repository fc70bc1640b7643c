#include "apps/commands/deform_sequence.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/commands/deform_result.hpp"
#include "apps/live/registration_input.hpp"
#include "base/stopwatch.hpp"

namespace livetet {

std::vector<MeasuredOrgan> read_later_points(
    const std::vector<std::string>& files,
    const std::optional<FiducialRegistration>& registration) {
    std::vector<MeasuredOrgan> lists;
    for (const std::string& file : files) {
        MeasuredOrgan& measured = lists.emplace_back();
        measured.source = file;
        measured.points = positions_of(read_point_list(file));
        if (registration)
            for (Vector3& c : measured.points) c = registration->image_from_base * c;
    }
    return lists;
}

std::vector<LaterFit> fit_later(const std::vector<MeasuredOrgan>& lists, double start_s,
                                const Scene& scene, const SceneBody& body,
                                DeformingRegistration& registering, ResultWriter* writer,
                                const ProgressCallback& progress) {
    const DeformOptions options = deform_options(scene);
    std::vector<LaterFit> fits;
    for (const MeasuredOrgan& measured : lists) {
        const auto start = std::chrono::steady_clock::now();
        const bool is_last = &measured == &lists.back();
        const int allowed = is_last ? options.max_iterations
                                    : std::min(options.later_iterations, options.max_iterations);
        LaterFit& fit = fits.emplace_back();
        fit.source = measured.source;
        fit.time_s = start_s + static_cast<double>(fits.size());
        fit.points = measured.points.size();
        fit.found = registering.finish(measured, progress, allowed);
        // Every frame of a result has the targets; those of a fit that converged are there.
        if (fit.found.targets.empty()) registering.place_targets(fit.found);
        fit.goes_on = !fit.found.report.converged && !is_last &&
                      fit.found.report.iterations == options.later_iterations;
        fit.seconds = seconds_since(start);
        if (writer) append_found(*writer, scene, body, fit.found, fit.time_s);
    }
    return fits;
}

nlohmann::json describe_later(const LaterFit& fit) {
    const SurfaceRegistrationReport& r = fit.found.report;
    const Vector3& f = r.total_force_N;
    return {{"source", fit.source},
            {"points", fit.points},
            {"time_s", fit.time_s},
            {"converged", r.converged},
            {"reason", r.reason},
            {"iterations", r.iterations},
            {"rms_before_mm", 1e3 * r.rms_before_m},
            {"rms_mm", 1e3 * r.rms_m},
            {"outliers", r.outliers},
            {"total_force_N", {f.x(), f.y(), f.z()}},
            {"fit_s", fit.found.fit_s},
            {"frame_s", fit.seconds}};
}

void print_later(const std::vector<LaterFit>& fits) {
    if (fits.empty()) return;
    fmt::print("{:>8} {:>7} {:>11} {:>10} {:>8} {:>13} {:>8}  {}\n", "frame/s", "points",
               "distance/mm", "iterations", "force/N", "95 % within/mm", "took/s", "points of");
    for (const LaterFit& fit : fits) {
        double radius_95 = 0;
        if (fit.found.report.converged)
            for (const TargetSpread& t : fit.found.targets)
                radius_95 = std::max(radius_95, t.radius_95);
        const SurfaceRegistrationReport& r = fit.found.report;
        fmt::print("{:>8g} {:>7} {:>11.2f} {:>10} {:>8.3g} {:>14} {:>8.2f}  {}{}\n", fit.time_s,
                   fit.points, 1e3 * r.rms_m, r.iterations, r.total_force_N.norm(),
                   radius_95 > 0 ? fmt::format("{:.2f}", 1e3 * radius_95) : "-", fit.seconds,
                   fit.source,
                   r.converged   ? ""
                   : fit.goes_on ? " (goes on)"
                                 : " (NOT converged)");
    }
}

}  // namespace livetet
