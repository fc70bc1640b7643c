#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/report.hpp"
#include "base/counted.hpp"

namespace livetet {

namespace {

std::string frames_verdict(const Report& r) {
    const Distribution& ms = r.frames.frame_ms;
    const double rate = r.run.mean_interval_ms > 0 ? 1e3 / r.run.mean_interval_ms : 0;
    return fmt::format(
        "Frames: {} of {} samples computed, {} missed; {:.1f} ms median and {:.1f} ms at the 99th "
        "percentile, "
        "of {:.1f} ms between samples in the median ({:.1f} samples a second in the mean).",
        r.run.frames, r.run.samples, r.run.missed, ms.median, ms.p99, r.run.interval_ms, rate);
}

/// "12 of 263 (4.6 %)", of the kept frames.
std::string share_of_frames(const Report& r, std::size_t count) {
    return fmt::format("{} of {} ({:.1f} %)", count, r.frames.kept,
                       100.0 * static_cast<double>(count) /
                           static_cast<double>(std::max<std::size_t>(r.frames.kept, 1)));
}

std::string budget_verdict(const Report& r) {
    const Distribution& e = r.frames.error_estimate_mm;
    std::string text = fmt::format(
        "Budget: of {:g} ms a frame, {} kept frames took longer; {} were cut short by it or by "
        "solver.max_iterations",
        r.run.budget_ms, share_of_frames(r, r.frames.over_budget),
        share_of_frames(r, r.frames.cut_short));
    if (e.count > 0)
        text += fmt::format(
            "; the solves left an error of {:.3f} mm in the mean, {:.3f} mm at worst, estimated",
            e.mean, e.worst);
    return text + ".";
}

std::string turned_verdict(const Report& r) {
    return fmt::format(
        "Elements: some were turned over in {} kept frames: displacements near them mean nothing. "
        "A press may be too deep for the mesh or the time scheme.",
        share_of_frames(r, r.frames.turned_over));
}

std::string placing_verdict(const Report& r) {
    return fmt::format(
        "Sensors: {} of {} NOT placed at the end, so the organ did not follow: a sensor is placed "
        "once it was seen at rest on the organ for track.base_window_s.",
        r.unplaced, std::max(r.sensors.size(), r.unplaced));
}

std::string slip_verdict(const Report& r) {
    return fmt::format(
        "Sensors: slipped over the organ {}. Each time the patch was let go, and the sensor "
        "placed anew where it came to rest.",
        counted(r.slips, "time"));
}

std::string cuts_verdict(const Report& r) {
    const RunCuts& c = *r.run.cuts;
    std::string text = "Cuts: none opened.";
    if (c.openings > 0) {
        text = fmt::format(
            "Cuts: {} of neighbouring cells parted and {} doubled, opened {}, in at most "
            "{:.0f} ms of a frame each; to prepare one took at most {:.0f} ms; ",
            counted(c.parted, "pair"), counted(c.nodes_added, "node"), counted(c.openings, "time"),
            c.longest_ms, c.prepared_ms);
        text += c.pieces == 1 ? "the body still hangs together"
                              : fmt::format("the body is in {} pieces", c.pieces);
        if (c.free_pieces > 0)
            text += fmt::format(", of which neither fix nor drive holds {}", c.free_pieces);
        text += ".";
    }
    if (c.longest_ms > r.run.budget_ms)
        text += fmt::format(
            " The longest opening took more than the {:.0f} ms of a frame: {}.", r.run.budget_ms,
            r.prepares_cuts ? "a longer track.cut_interval_s leaves more time to prepare"
                            : "pace: every-sample leaves no time between frames to prepare");
    if (c.waits)
        text +=
            " What was cut last had not opened when the run ended: that was within "
            "track.cut_interval_s.";
    if (c.gaps > 0)
        text += fmt::format(
            " NOT cut: {}, {:.0f} mm in the organ in all, too long between two samples in which "
            "the blade was seen.",
            counted(c.gaps, "blade path"), c.gaps_mm);
    return text;
}

std::string press_verdict(const TargetErrors& t) {
    return fmt::format(
        "Deepest press ({:.1f} mm): {} {} off by {:.2f} mm RMS with deformation, {:.2f} mm "
        "rigid-only: {:.1f} times smaller, {} the {:g} times asked for.",
        t.deepest_press_mm, counted(t.moving, "moving target"), t.moving == 1 ? "is" : "are",
        t.deforming_mm.rms, t.rigid_mm.rms, t.gain(),
        t.gain() >= wanted_gain ? "at least" : "LESS than", wanted_gain);
}

std::string rest_verdict(const RestErrors& r) {
    return fmt::format(
        "At rest: while the organ went {:.0f} mm and turned {:.0f} degrees, the model moved "
        "targets by {:.2f} "
        "mm RMS, {:.2f} mm at worst: {} than registration noise explains ({:.2f} mm RMS, {:.2f} mm "
        "at worst).",
        r.organ_travel_mm, r.organ_turn_deg, r.moved_mm.rms, r.moved_mm.worst,
        r.explained() ? "no more" : "MORE", r.expected_rms_mm, 3 * r.expected_rms_mm);
}

std::string run_text(const Report& r) {
    std::string out = "RUN\n";
    out += report_line("result", r.source);
    out += report_line("mesh", fmt::format("{}, {} nodes, {}", r.elements, r.run.nodes,
                                           counted(r.run.levels, "level")));
    if (!r.run.solver.empty()) out += report_line("solver", r.run.solver);
    if (!r.run.version.empty()) out += report_line("livetet", r.run.version);
    if (!r.run.problem.empty()) out += report_line("ended early", r.run.problem);
    out += report_line("time", fmt::format("{:.2f} to {:.2f} s, {} kept", r.first_s, r.last_s,
                                           counted(r.frames.kept, "frame")));
    out += report_line("largest press", fmt::format("{:.1f} mm, as the deformation sensor saw it",
                                                    r.largest_press_mm));
    return out;
}

std::string registration_text(const Report& r) {
    std::size_t width = 10;
    for (const RunFiducial& f : r.run.fiducials) width = std::max(width, f.name.size() + 2);
    std::string out =
        fmt::format("REGISTRATION\n  FRE {:.2f} mm (RMS of the residuals)\n", r.run.fre_mm);
    out +=
        fmt::format("  {:<{}}{:>13}{:>18}\n", "fiducial", width, "residual [mm]", "left out [mm]");
    for (const RunFiducial& f : r.run.fiducials)
        out += fmt::format("  {:<{}}{:>13.2f}{:>18}\n", f.name, width, f.residual_mm,
                           f.leave_one_out_mm ? fmt::format("{:.2f}", *f.leave_one_out_mm) : "-");
    return out + "  (left out: distance of a fiducial from its position predicted by the others)\n";
}

/// Empty if the distribution is.
std::string row(std::string_view name, const Distribution& d, int digits = 2) {
    if (d.count == 0) return "";
    return fmt::format("  {:<22}{:>10.{}f}{:>10.{}f}{:>10.{}f}{:>10.{}f}{:>10.{}f}\n", name,
                       d.median, digits, d.mean, digits, d.p95, digits, d.p99, digits, d.worst,
                       digits);
}

std::string frames_text(const Report& r) {
    const FrameStatistics& f = r.frames;
    std::string out = fmt::format("FRAMES\n  {:<22}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "", "median",
                                  "mean", "95 %", "99 %", "worst");
    out += row("whole frame [ms]", f.frame_ms) + row("  sensor [ms]", f.sensor_ms) +
           row("  forces [ms]", f.forces_ms) + row("  operator [ms]", f.operator_ms) +
           row("  solve [ms]", f.solve_ms) + row("  finish [ms]", f.finish_ms) +
           row("  output [ms]", f.output_ms) + row("  statement [ms]", f.statement_ms) +
           row("poses ahead [ms]", f.ahead_ms) + row("iterations", f.iterations) +
           row("error estimate [mm]", f.error_estimate_mm, 4);
    if (f.error_estimate_mm.count > 0)
        out +=
            "  (error estimate, RMS over the nodes: the error of the frame's last linear solve;\n"
            "   not of linearisation, discretisation or registration)\n";
    out += report_line("between samples", fmt::format("{:.1f} ms median, {:.1f} ms mean",
                                                      r.run.interval_ms, r.run.mean_interval_ms));
    out += report_line("budget",
                       fmt::format("{:g} ms ({}); {} kept frames took longer", r.run.budget_ms,
                                   r.run.budget_given ? "track.budget" : "time between samples",
                                   share_of_frames(r, f.over_budget)));
    if (r.run.budget_given)
        out += report_line("cut short", share_of_frames(r, f.cut_short) +
                                            " kept frames, by it or by solver.max_iterations");
    out += report_line("missed", fmt::format("{} of {} samples", r.run.missed, r.run.samples));
    if (r.run.not_kept > 0)
        out += report_line("not kept",
                           counted(r.run.not_kept, "frame") + ": the disk was too slow, or full");
    out += report_line("registration",
                       fmt::format("held in {}, lost in {}", counted(f.registration_held, "frame"),
                                   f.registration_lost));
    if (const std::string lags = lags_text(r.run.poses); !lags.empty())
        out += report_line("poses lag", lags);
    if (f.turned_over > 0)
        out += report_line("turned over",
                           "elements in " + share_of_frames(r, f.turned_over) + " kept frames");
    return out + report_line("not converged", counted(f.not_converged, "frame"));
}

std::string sensors_text(const Report& r) {
    std::string out = "SENSORS\n";
    for (const ReportSensor& s : r.sensors) out += report_line(s.tool, sensor_text(s));
    if (!r.sensor_frames) return out;
    for (std::size_t s = 0; s < r.sensor_frames->size(); ++s)
        if (const double frames = (*r.sensor_frames)[s]; frames > 0)
            out += report_line(sensor_states[s], counted(std::lround(frames), "frame"));
    return out;
}

std::string error_row(std::string_view name, const Distribution& d) {
    return fmt::format("  {:<22}{:>10.2f}{:>10.2f}{:>10.2f}{:>10.2f}\n", name, d.rms, d.mean, d.p95,
                       d.worst);
}

std::string truth_text(const TargetErrors& t) {
    const std::string heads =
        fmt::format("  {:<22}{:>10}{:>10}{:>10}{:>10}\n", "", "RMS", "mean", "95 %", "worst");
    std::string out = fmt::format(
        "ERROR AT THE TARGETS, DEEPEST PRESS [mm]\n  {} of {} targets move more than 3 mm (at most "
        "{:.1f} mm); {} at 95 % of {:.1f} mm or more\n",
        t.moving, t.targets, t.largest_motion_mm, counted(t.deepest_frames, "frame"),
        t.deepest_press_mm);
    out += heads + error_row("rigid-only", t.rigid_mm) + error_row("deforming", t.deforming_mm) +
           error_row("  registration part", t.registration_mm) +
           error_row("  deformation part", t.deformation_mm);
    if (t.unregistered_frames > 0)
        out += fmt::format("  {} without a registration yet, left out\n",
                           counted(t.unregistered_frames, "frame"));
    if (t.ahead_ms.worst > 0)
        out += fmt::format(
            "  compared with the truth at the times that poses are predicted to: {:.1f} ms after\n"
            "  the samples in the mean\n",
            t.ahead_ms.mean);
    if (t.beyond_truth_frames > 0)
        out += fmt::format("  {} predicted beyond the truth's end, left out\n",
                           counted(t.beyond_truth_frames, "frame"));

    const RestErrors& r = t.rest;
    out += fmt::format(
        "\nERROR AT THE TARGETS, NOTHING PRESSED, ORGAN MOVING [mm]\n  {}; the organ went "
        "{:.0f} mm and "
        "turned {:.0f} degrees\n",
        counted(r.frames, "frame"), r.organ_travel_mm, r.organ_turn_deg);
    out += heads + error_row("moved by the model", r.moved_mm) +
           error_row("registration", r.registration_mm);
    out += report_line(
        "noise expected",
        fmt::format("{:.2f} mm RMS, from the tracker's noise and the FRE", r.expected_rms_mm));
    return out + report_line("registration", lag_text(r.registration_lag_ms));
}

}  // namespace

std::vector<std::string> verdicts(const Report& report) {
    std::vector<std::string> sentences{frames_verdict(report)};
    if (report.run.budget_given) sentences.push_back(budget_verdict(report));
    if (report.frames.turned_over > 0) sentences.push_back(turned_verdict(report));
    if (report.unplaced > 0) sentences.push_back(placing_verdict(report));
    if (report.slips > 0) sentences.push_back(slip_verdict(report));
    if (report.run.cuts) sentences.push_back(cuts_verdict(report));
    if (const std::string noise = noise_text(report.run.poses); !noise.empty())
        sentences.push_back("Tracker: the " + noise + ".");
    sentences.insert(sentences.end(), report.notes.begin(), report.notes.end());
    if (report.truth) {
        sentences.push_back(press_verdict(*report.truth));
        if (report.truth->rest.frames > 0) sentences.push_back(rest_verdict(report.truth->rest));
    }
    return sentences;
}

std::string sensor_text(const ReportSensor& s) {
    return fmt::format("a patch of {:g} mm radius follows its {}, {}", s.patch_radius_mm,
                       s.turns ? "translation and rotation" : "translation",
                       s.stiffness_N_per_m
                           ? fmt::format("by springs of {:g} N/m", *s.stiffness_N_per_m)
                           : "rigidly");
}

std::string report_text(const Report& report) {
    std::string out = "LIVETET: REPORT OF A TRACKED RUN\n\n";
    for (const std::string& sentence : verdicts(report)) out += "  " + wrapped(sentence);
    out += "\n" + run_text(report) + "\n" + registration_text(report) + "\n" + frames_text(report);
    if (!report.sensors.empty() || report.sensor_frames) out += "\n" + sensors_text(report);
    if (report.truth) out += "\n" + truth_text(*report.truth);
    if (report.stated)
        out += "\nSTATED ERROR AT THE TARGETS [mm]\n" + table_text(radius_table(*report.stated)) +
               table_text(source_table(*report.stated));
    if (!report.parts.empty()) out += "\n" + parts_text(report.parts);
    return out;
}

}  // namespace livetet
