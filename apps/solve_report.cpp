#include "apps/solve_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "config/yaml.hpp"

namespace livetet {

namespace {

using json = nlohmann::ordered_json;

constexpr std::size_t most_rows = 24;  // of a page's table of steps

SolvedRun parse_run(const std::string& text, const std::string& source) {
    try {
        const json j = json::parse(text);
        SolvedRun run{.solver = j.at("solver"), .version = j.value("version", ""), .failure = j.value("failure", ""), .levels = j.at("levels"),
                      .ranks = j.at("ranks"), .converged = j.at("converged"), .mesh_s = j.at("mesh_s"), .setup_s = j.at("setup_s"),
                      .solve_s = j.at("solve_s"), .peak_bytes = j.at("peak_bytes"), .forces_N = {}, .steps = {}};
        for (const auto& [key, force] : j.at("reactions_N").items())
            run.forces_N.emplace_back(key, Eigen::Vector3d(force.at(0), force.at(1), force.at(2)));
        const auto number = [](const json& x) { return x.is_null() ? std::nan("") : x.get<double>(); };  // JSON has no NaN
        for (const json& s : j.at("steps"))
            run.steps.push_back({.time_s = s.at("time_s"), .step_s = s.at("step_s"), .seconds = s.at("seconds"), .imbalance = number(s.at("imbalance")),
                                 .time_error_mm = number(s.at("time_error_mm")), .linearisations = s.at("linearisations"),
                                 .iterations = s.at("iterations"), .converged = s.at("converged")});
        return run;
    } catch (const json::exception& e) {
        fail("{}: what the solve says of itself does not hold together: {}", source, e.what());
    }
}

/// The steps that a table shows: all, or every so many of them and the last.
std::vector<const SolvedStep*> shown_steps(const SolvedRun& run) {
    const std::size_t every = (run.steps.size() + most_rows - 1) / most_rows;
    std::vector<const SolvedStep*> shown;
    for (std::size_t k = 0; k < run.steps.size(); ++k)
        if ((k + 1) % every == 0 || k + 1 == run.steps.size()) shown.push_back(&run.steps[k]);
    return shown;
}

std::string thinned_note(const SolvedRun& run) {
    const std::size_t every = (run.steps.size() + most_rows - 1) / most_rows;
    return every > 1 ? fmt::format("Of {} steps one in {}. ", run.steps.size(), every) : "";
}

std::vector<std::pair<std::string, std::string>> run_rows(const SolveReport& r) {
    std::vector<std::pair<std::string, std::string>> rows{{"result", r.source}};
    rows.emplace_back("mesh", fmt::format("{} tets, {} nodes{}", r.tets, r.nodes, r.run ? fmt::format(", {} level(s)", r.run->levels) : ""));
    if (r.run) {
        rows.emplace_back("solver", r.run->solver);
        rows.emplace_back("ranks", fmt::format("{}", r.run->ranks));
        rows.emplace_back("seconds", fmt::format("mesh {:.2f}, set-up {:.2f}, solve {:.2f}", r.run->mesh_s, r.run->setup_s, r.run->solve_s));
        rows.emplace_back("memory", fmt::format("{:.0f} MB at the peak, all ranks", r.run->peak_bytes / 1e6));
        if (!r.run->version.empty()) rows.emplace_back("livetet", r.run->version);
    }
    rows.emplace_back("kept", fmt::format("{} frame(s), {:.4g} to {:.4g} s", r.frames, r.first_s, r.last_s));
    return rows;
}

}  // namespace

SolveReport make_solve_report(const ResultReader& result, const std::filesystem::path& source) {
    if (result.frame_count() == 0) fail("{}: holds no frame, expected at least one", source.string());
    SolveReport r{.source = source.string(), .scene_text = result.scene_text(), .tets = result.mesh().tets.size(), .nodes = result.mesh().nodes.size(),
                  .frames = result.frame_count(), .first_s = result.times_s().front(), .last_s = result.times_s().back(), .run = {}, .parts = {}};
    for (std::size_t k = 0; k < r.frames; ++k) {
        r.last_mm = 0;
        for (const Vector3& u : result.displacement(k)) r.last_mm = std::max(r.last_mm, 1e3 * u.norm());
        if (r.last_mm > r.largest_mm) {
            r.largest_mm = r.last_mm;
            r.largest_frame = k;
        }
    }
    if (!result.has_text("solve")) return r;
    r.run = parse_run(result.text("solve"), r.source);
    try {
        const Scene scene = read_yaml<Scene>(r.scene_text, r.source);
        r.parts = explain_parts(scene, r.tets, r.run->levels, r.run->solver.find("multigrid") != std::string::npos);
    } catch (const Error&) {  // a scene of a later version may have keys that this one does not know
    }
    return r;
}

std::vector<std::string> verdicts(const SolveReport& r) {
    std::vector<std::string> sentences;
    if (r.run) {
        int linearisations = 0, iterations = 0;
        double time_error_mm = 0;
        for (const SolvedStep& s : r.run->steps) {
            linearisations += s.linearisations;
            iterations += s.iterations;
            time_error_mm = std::max(time_error_mm, s.time_error_mm);
        }
        sentences.push_back(fmt::format("{} in {} step(s), {} linearisations, {} iterations and {:.2f} s; {:.1e} of the forces are out of balance in the end.",
                                        r.run->converged ? "Converged" : "NOT converged", r.run->steps.size(), linearisations, iterations,
                                        r.run->solve_s, r.run->steps.empty() ? 0 : r.run->steps.back().imbalance));
        if (!r.run->failure.empty()) sentences.push_back(fmt::format("It ended so: {}.", r.run->failure));
        if (time_error_mm > 0) sentences.push_back(fmt::format("A time step errs by {:.3g} mm at most, estimated.", time_error_mm));
    }
    sentences.push_back(r.frames > 1 ? fmt::format("The body moves by {:.3f} mm at most, {:.3f} mm in the last of {} frames.", r.largest_mm, r.last_mm, r.frames)
                                     : fmt::format("The body moves by {:.3f} mm at most.", r.largest_mm));
    return sentences;
}

std::string report_text(const SolveReport& r) {
    std::string out = "LIVETET: REPORT OF A SOLVE\n\n";
    for (const std::string& sentence : verdicts(r)) out += "  " + wrapped(sentence);
    out += "\nRUN\n";
    for (const auto& [name, value] : run_rows(r)) out += report_line(name, value);
    if (r.run && !r.run->forces_N.empty()) {
        out += "\nFORCES ON THE BODY [N]\n";
        for (const auto& [key, f] : r.run->forces_N) out += report_line(key, fmt::format("{:>12.5g}{:>12.5g}{:>12.5g}", f.x(), f.y(), f.z()));
    }
    if (r.run && !r.run->steps.empty()) {
        out += fmt::format("\nSTEPS\n  {:>10}{:>10}{:>16}{:>12}{:>12}{:>17}{:>10}\n", "time [s]", "step [s]", "linearisations", "iterations", "imbalance",
                           "time error [mm]", "[s]");
        for (const SolvedStep* s : shown_steps(*r.run))
            out += fmt::format("  {:>10.4g}{:>10.4g}{:>16}{:>12}{:>12.1e}{:>17.3g}{:>10.3f}{}\n", s->time_s, s->step_s, s->linearisations, s->iterations,
                               s->imbalance, s->time_error_mm, s->seconds, s->converged ? "" : "  NOT");
        if (const std::string note = thinned_note(*r.run); !note.empty()) out += fmt::format("  ({})\n", note.substr(0, note.size() - 2));
    }
    if (!r.parts.empty()) out += "\n" + parts_text(r.parts);
    return out;
}

std::string report_json(const SolveReport& r) {
    json out = {{"result", r.source},
                {"verdicts", verdicts(r)},
                {"tets", r.tets},
                {"nodes", r.nodes},
                {"frames", r.frames},
                {"first_s", r.first_s},
                {"last_s", r.last_s},
                {"largest_displacement_mm", r.largest_mm},
                {"last_displacement_mm", r.last_mm}};
    if (r.run) {
        json steps = json::array(), forces = json::object(), parts = json::array();
        for (const SolvedStep& s : r.run->steps)
            steps.push_back({{"time_s", s.time_s}, {"step_s", s.step_s}, {"converged", s.converged}, {"linearisations", s.linearisations},
                             {"iterations", s.iterations}, {"imbalance", s.imbalance}, {"time_error_mm", s.time_error_mm}, {"seconds", s.seconds}});
        for (const auto& [key, f] : r.run->forces_N) forces[key] = {f.x(), f.y(), f.z()};
        for (const ExplainedPart& p : r.parts) parts.push_back({{"part", p.part}, {"built", p.built}, {"why", p.why}});
        out.update({{"solver", r.run->solver}, {"version", r.run->version}, {"levels", r.run->levels}, {"ranks", r.run->ranks},
                    {"converged", r.run->converged}, {"failure", r.run->failure}, {"mesh_s", r.run->mesh_s}, {"setup_s", r.run->setup_s},
                    {"solve_s", r.run->solve_s}, {"peak_bytes", r.run->peak_bytes}, {"reactions_N", forces}, {"steps", steps}, {"parts", parts}});
    }
    return out.dump(2) + "\n";
}

std::string report_page(const SolveReport& r, std::span<const PagePicture> pictures, const std::string& no_pictures) {
    HtmlSection run("The run");
    for (const auto& [name, value] : run_rows(r)) run.texts({name, value});
    std::string body;
    if (r.run && !r.run->forces_N.empty()) {
        HtmlSection s("Forces on the body [N]");
        s.heads({"", "x", "y", "z"});
        for (const auto& [key, f] : r.run->forces_N) s.row({key, fmt::format("{:.5g}", f.x()), fmt::format("{:.5g}", f.y()), fmt::format("{:.5g}", f.z())});
        body += s.end();
    }
    if (r.run && !r.run->steps.empty()) {
        HtmlSection s("Steps");
        s.heads({"time [s]", "step [s]", "linearisations", "iterations", "imbalance", "time error [mm]", "took [s]"});
        for (const SolvedStep* step : shown_steps(*r.run))
            s.row({fmt::format("{:.4g}{}", step->time_s, step->converged ? "" : " NOT converged"), fmt::format("{:.4g}", step->step_s),
                   fmt::format("{}", step->linearisations), fmt::format("{}", step->iterations), fmt::format("{:.1e}", step->imbalance),
                   fmt::format("{:.3g}", step->time_error_mm), fmt::format("{:.3f}", step->seconds)});
        body += s.end(thinned_note(*r.run) + "Imbalance: the forces out of balance, relative to those at work.");
    }
    body += run.end();
    if (!r.parts.empty()) body += parts_html(r.parts);
    return html_page("Report of a solve", verdicts(r), pictures, no_pictures, body, r.scene_text);
}

}  // namespace livetet
