#include <fmt/format.h>

#include <cmath>

#include "apps/report/report.hpp"
#include "base/counted.hpp"

namespace livetet {

namespace {

std::string run_html(const Report& r) {
    HtmlSection s("The run");
    s.texts({"result", r.source});
    s.texts({"mesh", fmt::format("{}, {} nodes, {}", r.elements, r.run.nodes,
                                 counted(r.run.levels, "level"))});
    if (!r.run.solver.empty()) s.texts({"solver", r.run.solver});
    s.texts({"time", fmt::format("{:.2f} to {:.2f} s, {} kept", r.first_s, r.last_s,
                                 counted(r.frames.kept, "frame"))});
    s.texts({"largest press",
             fmt::format("{:.1f} mm, as the deformation sensor saw it", r.largest_press_mm)});
    if (const std::string lags = lags_text(r.run.poses); !lags.empty())
        s.texts({"poses lag", lags});
    if (!r.run.problem.empty()) s.texts({"ended early", r.run.problem});
    s.texts(
        {"versions",
         fmt::format("{}this page by livetet {}",
                     r.run.version.empty() ? "" : fmt::format("run by livetet {}, ", r.run.version),
                     LIVETET_VERSION)});
    return s.end();
}

std::string registration_html(const Report& r) {
    HtmlSection s("Registration");
    s.heads({"", "residual [mm]", "left out [mm]"});
    for (const RunFiducial& f : r.run.fiducials) {
        if (f.leave_one_out_mm)
            s.numbers(f.name, {f.residual_mm, *f.leave_one_out_mm}, 2);
        else
            s.numbers(f.name, {f.residual_mm}, 2);
    }
    s.numbers("FRE (RMS of the residuals)", {r.run.fre_mm}, 2);
    return s.end(
        "Left out: distance of a fiducial from its position predicted by the others. Held in " +
        fmt::format("{}, lost in {}.", counted(r.frames.registration_held, "frame"),
                    r.frames.registration_lost));
}

std::string frames_html(const Report& r) {
    const FrameStatistics& f = r.frames;
    HtmlSection s("Frames, and what each stage took");
    s.heads({"", "median", "mean", "95 %", "99 %", "worst"});
    const auto row = [&](std::string_view name, const Distribution& d, int digits = 2) {
        if (d.count > 0) s.numbers(name, {d.median, d.mean, d.p95, d.p99, d.worst}, digits);
    };
    row("whole frame [ms]", f.frame_ms);
    row("sensor [ms]", f.sensor_ms);
    row("forces [ms]", f.forces_ms);
    row("operator [ms]", f.operator_ms);
    row("solve [ms]", f.solve_ms);
    row("finish [ms]", f.finish_ms);
    row("output [ms]", f.output_ms);
    row("statement [ms]", f.statement_ms);
    row("poses ahead [ms]", f.ahead_ms);
    row("iterations", f.iterations);
    row("error estimate [mm]", f.error_estimate_mm, 4);
    return s.end(fmt::format(
        "{} of {} samples computed, {} missed, {} not kept; {} took longer than {:g} ms "
        "({}), {} cut short by it or by solver.max_iterations; "
        "{} did not converge; {} had elements that were turned over. The error estimate, RMS over "
        "the nodes, is the error of the frame's "
        "last linear solve; not of linearisation, discretisation or registration.",
        r.run.frames, r.run.samples, r.run.missed, r.run.not_kept, counted(f.over_budget, "frame"),
        r.run.budget_ms, r.run.budget_given ? "track.budget" : "the time between samples",
        f.cut_short, f.not_converged, f.turned_over));
}

std::string sensors_html(const Report& r) {
    HtmlSection s("Sensors");
    for (const ReportSensor& sensor : r.sensors) s.texts({sensor.tool, sensor_text(sensor)});
    if (r.sensor_frames)
        for (std::size_t i = 0; i < r.sensor_frames->size(); ++i)
            s.texts({sensor_states[i], counted(std::lround((*r.sensor_frames)[i]), "frame")});
    return s.end();
}

std::string truth_html(const TargetErrors& t) {
    HtmlSection s("Error at the targets [mm]");
    s.heads({"", "RMS", "mean", "95 %", "worst"});
    const auto row = [&](std::string_view name, const Distribution& d) {
        s.numbers(name, {d.rms, d.mean, d.p95, d.worst}, 2);
    };
    row("deepest press: rigid-only", t.rigid_mm);
    row("deepest press: with deformation", t.deforming_mm);
    row("of which the registration", t.registration_mm);
    row("of which the deformation", t.deformation_mm);
    row("nothing pressed, organ moving: moved by the model", t.rest.moved_mm);
    row("nothing pressed, organ moving: the registration", t.rest.registration_mm);
    std::string note = fmt::format(
        "{} of {} targets move more than 3 mm; {:.1f} times smaller with deformation. The "
        "tracker's noise alone explains {:.2f} mm RMS; the registration is {}.",
        t.moving, t.targets, t.gain(), t.rest.expected_rms_mm,
        lag_text(t.rest.registration_lag_ms));
    if (t.ahead_ms.worst > 0)
        note += fmt::format(
            " Compared with the truth at the times that poses are predicted to, {:.1f} ms after "
            "the samples in the mean.",
            t.ahead_ms.mean);
    return s.end(note);
}

}  // namespace

std::string report_page(const Report& r, std::span<const PagePicture> pictures,
                        const std::string& no_pictures) {
    std::string body;
    if (r.truth) body += truth_html(*r.truth);
    if (r.stated)
        body += table_html("Stated error at the targets [mm]", radius_table(*r.stated)) +
                table_html("Stated error by source [mm]", source_table(*r.stated));
    body += frames_html(r) + registration_html(r);
    if (!r.sensors.empty() || r.sensor_frames) body += sensors_html(r);
    body += run_html(r);
    if (!r.parts.empty()) body += parts_html(r.parts);
    return html_page("Report of a tracked run", verdicts(r), pictures, no_pictures, body,
                     r.scene_text);
}

}  // namespace livetet
