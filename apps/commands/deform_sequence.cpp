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
        const int allowed = std::min(options.later_iterations, options.max_iterations);
        LaterFit& fit = fits.emplace_back();
        fit.source = measured.source;
        fit.time_s = start_s + static_cast<double>(fits.size());
        fit.points = measured.points.size();
        fit.found = registering.finish(measured, progress, allowed);
        fit.seconds = seconds_since(start);
        const bool is_cut_short =
            !fit.found.report.converged && fit.found.report.iterations == allowed;
        fit.goes_on = is_cut_short && !is_last;
        if (is_cut_short && is_last && allowed < options.max_iterations) {
            const SurfaceRegistrationReport before = fit.found.report;
            fit.found = registering.finish(measured, progress, options.max_iterations - allowed);
            fit.found.report.iterations += before.iterations;
            fit.found.report.rms_before_m = before.rms_before_m;
            fit.settled_s = seconds_since(start);
        }
        // Every frame of a result has the targets; those of a fit that converged are there.
        if (fit.found.targets.empty()) registering.place_targets(fit.found);
        if (writer) append_found(*writer, scene, body, fit.found, fit.time_s);
    }
    return fits;
}

nlohmann::json describe_later(const LaterFit& fit) {
    const SurfaceRegistrationReport& r = fit.found.report;
    const Vector3& f = r.total_force_N;
    nlohmann::json about{{"source", fit.source},
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
    if (fit.settled_s > 0) about["settled_s"] = fit.settled_s;
    return about;
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
                   fit.goes_on         ? " (goes on)"
                   : !r.converged      ? " (NOT converged)"
                   : fit.settled_s > 0 ? fmt::format(" (settled after {:.2f} s)", fit.settled_s)
                                       : "");
    }
}

}  // namespace livetet
