#include <fmt/format.h>

#include "apps/report.hpp"

namespace livetet {

namespace {

/// Text as HTML shows it: names come from files.
std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

constexpr const char* head = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Livetet: report of a tracked run</title>
<style>
body { font: 15px/1.5 sans-serif; color: #222; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h2 { margin-top: 2rem; border-bottom: 1px solid #ccc; font-size: 1.15rem; }
table { border-collapse: collapse; }
th, td { padding: .15rem .8rem .15rem 0; text-align: left; vertical-align: top; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
tr + tr { border-top: 1px solid #eee; }
img { max-width: 100%; border: 1px solid #ddd; }
figure { margin: 1rem 0; }
figcaption, .note { color: #555; }
pre { overflow-x: auto; background: #f6f6f6; padding: 1rem; }
</style></head><body>
)";

/// A table under a heading, row by row. Cells that are numbers stand to the right.
class Section {
  public:
    explicit Section(std::string_view title) : html_(fmt::format("<section><h2>{}</h2>\n<table>\n", escaped(title))) {}

    void heads(std::initializer_list<std::string_view> names) {
        html_ += "<tr>";
        for (const auto name : names) html_ += fmt::format("<th class=\"{}\">{}</th>", name == *names.begin() ? "" : "n", escaped(name));
        html_ += "</tr>\n";
    }
    void texts(std::initializer_list<std::string> cells) {
        html_ += "<tr>";
        for (const auto& cell : cells) html_ += fmt::format("<td>{}</td>", escaped(cell));
        html_ += "</tr>\n";
    }
    void numbers(std::string_view name, std::initializer_list<double> values, int digits) {
        html_ += fmt::format("<tr><td>{}</td>", escaped(name));
        for (const double v : values) html_ += fmt::format("<td class=\"n\">{:.{}f}</td>", v, digits);
        html_ += "</tr>\n";
    }
    std::string end(std::string_view note = "") {
        html_ += "</table>\n";
        if (!note.empty()) html_ += fmt::format("<p class=\"note\">{}</p>\n", escaped(note));
        return html_ + "</section>\n";
    }

  private:
    std::string html_;
};

std::string run_section(const Report& r) {
    Section s("The run");
    s.texts({"result", r.source});
    s.texts({"mesh", fmt::format("{} tets, {} nodes, {} level(s)", r.run.tets, r.run.nodes, r.run.levels)});
    if (!r.run.solver.empty()) s.texts({"solver", r.run.solver});
    s.texts({"time", fmt::format("{:.2f} to {:.2f} s, {} frames kept", r.first_s, r.last_s, r.frames.kept)});
    s.texts({"largest press", fmt::format("{:.1f} mm, as the deformation sensor saw it", r.largest_press_mm)});
    if (!r.run.problem.empty()) s.texts({"ended early", r.run.problem});
    s.texts({"versions", fmt::format("{}this page by livetet {}", r.run.version.empty() ? "" : fmt::format("run by livetet {}, ", r.run.version),
                                     LIVETET_VERSION)});
    return s.end();
}

std::string registration_section(const Report& r) {
    Section s("Registration");
    s.heads({"", "residual [mm]", "left out [mm]"});
    for (const RunFiducial& f : r.run.fiducials) {
        if (f.leave_one_out_mm)
            s.numbers(f.name, {f.residual_mm, *f.leave_one_out_mm}, 2);
        else
            s.numbers(f.name, {f.residual_mm}, 2);
    }
    s.numbers("FRE (RMS of the residuals)", {r.run.fre_mm}, 2);
    return s.end("Left out: how far a fiducial lies from where the others alone put it. Held in " +
                 fmt::format("{} frames, lost in {}.", r.frames.registration_held, r.frames.registration_lost));
}

std::string frames_section(const Report& r) {
    const FrameStatistics& f = r.frames;
    Section s("Frames, and what each stage took");
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
    row("iterations", f.iterations);
    row("error estimate [mm]", f.error_estimate_mm, 4);
    return s.end(fmt::format("{} of {} samples computed, {} missed, {} not kept; {} frames took longer than {:g} ms ({}), {} were cut short by it; "
                             "{} did not converge. The error estimate is what a frame's solve left undone, RMS over the nodes.",
                             r.run.frames, r.run.samples, r.run.missed, r.run.not_kept, f.over_budget, r.run.budget_ms,
                             r.run.budget_given ? "track.budget" : "the time between samples", f.cut_short, f.not_converged));
}

std::string sensors_section(const Report& r) {
    Section s("Sensors");
    for (const ReportSensor& sensor : r.sensors) s.texts({sensor.tool, sensor_text(sensor)});
    if (r.sensor_frames)
        for (std::size_t i = 0; i < r.sensor_frames->size(); ++i)
            s.texts({sensor_states[i], fmt::format("{:g} frames", (*r.sensor_frames)[i])});
    return s.end();
}

std::string truth_section(const TargetErrors& t) {
    Section s("Error at the targets [mm]");
    s.heads({"", "RMS", "mean", "95 %", "worst"});
    const auto row = [&](std::string_view name, const Distribution& d) { s.numbers(name, {d.rms, d.mean, d.p95, d.worst}, 2); };
    row("deepest press: rigid-only", t.rigid_mm);
    row("deepest press: with deformation", t.deforming_mm);
    row("of which the registration", t.registration_mm);
    row("of which the deformation", t.deformation_mm);
    row("nothing pressed, organ moving: moved by the model", t.rest.moved_mm);
    row("nothing pressed, organ moving: the registration", t.rest.registration_mm);
    return s.end(fmt::format("{} of {} targets move more than 3 mm; {:.1f} times smaller with deformation. The tracker's noise alone explains "
                             "{:.2f} mm RMS; the registration lags by {:.0f} ms.",
                             t.moving, t.targets, t.gain(), t.rest.expected_rms_mm, t.rest.registration_lag_ms));
}

std::string parts_section(const Report& r, bool built) {
    Section s(built ? "What was built" : "What was left out, and why");
    for (const ExplainedPart& p : r.parts)
        if (p.built == built) s.texts({p.part, p.why});
    return s.end();
}

}  // namespace

std::string report_page(const Report& r, std::span<const PagePicture> pictures, const std::string& no_pictures) {
    std::string out = head;
    out += "<h1>Report of a tracked run</h1>\n<ul>\n";
    for (const std::string& sentence : verdicts(r)) out += fmt::format("<li>{}</li>\n", escaped(sentence));
    out += "</ul>\n";
    for (const PagePicture& p : pictures)
        out += fmt::format("<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n",
                           escaped(p.caption), p.base64);
    if (!no_pictures.empty()) out += fmt::format("<p class=\"note\">Pictures are left out: {}.</p>\n", escaped(no_pictures));
    if (r.truth) out += truth_section(*r.truth);
    out += frames_section(r) + registration_section(r);
    if (!r.sensors.empty() || r.sensor_frames) out += sensors_section(r);
    out += run_section(r);
    if (!r.parts.empty()) out += parts_section(r, true) + parts_section(r, false);
    if (!r.scene_text.empty())
        out += fmt::format("<section><h2>Scene</h2><details><summary>every value it resolved to</summary>\n<pre>{}</pre></details></section>\n",
                           escaped(r.scene_text));
    return out + "</body></html>\n";
}

}  // namespace livetet
