#include "apps/report/solve_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/scene/cuts.hpp"
#include "apps/scene/model_limits.hpp"
#include "apps/scene/scene_image.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "config/yaml.hpp"
#include "mesh/hex_grid.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

using ordered_json = nlohmann::ordered_json;

constexpr std::size_t max_rows = 24;  // rows of a page's table of steps

double number(const ordered_json& x) {
    return x.is_null() ? std::nan("") : x.get<double>();
}  // JSON has no NaN

/// Reads a whole number from 0 to `max`.
std::size_t count(const ordered_json& x, std::size_t max) {
    const auto n = x.get<double>();
    if (!(n >= 0 && n <= static_cast<double>(max))) fail("found {}, expected 0 to {}", n, max);
    return static_cast<std::size_t>(n);
}

SolvedRun parse_run(const std::string& text) {
    constexpr std::size_t max = 1'000'000'000;
    try {
        const ordered_json j = ordered_json::parse(text);
        SolvedRun run{.solver = j.at("solver"),
                      .version = j.at("version"),
                      .failure = j.at("failure"),
                      .levels = count(j.at("levels"), max),
                      .ranks = count(j.at("ranks"), max),
                      .inverted_tets = count(j.value("inverted_tets", ordered_json(0)), max),
                      .converged = j.at("converged"),
                      .is_static = j.at("is_static"),
                      .restarted_at_s = number(j.at("restarted_at_s")),
                      .mesh_s = number(j.at("mesh_s")),
                      .setup_s = number(j.at("setup_s")),
                      .solve_s = number(j.at("solve_s")),
                      .peak_bytes = number(j.at("peak_bytes")),
                      .forces_N = {},
                      .steps = {}};
        for (const auto& [key, f] : j.at("reactions_N").items())
            run.forces_N.emplace_back(
                key, Eigen::Vector3d(number(f.at(0)), number(f.at(1)), number(f.at(2))));
        for (const ordered_json& s : j.at("steps"))
            run.steps.push_back({.time_s = number(s.at("time_s")),
                                 .step_s = number(s.at("step_s")),
                                 .seconds = number(s.at("seconds")),
                                 .imbalance = number(s.at("imbalance")),
                                 .time_error_mm = number(s.at("time_error_mm")),
                                 .newton_iterations = count(s.at("linearisations"), max),
                                 .iterations = count(s.at("iterations"), max),
                                 .converged = s.at("converged"),
                                 .kept = s.at("kept")});
        return run;
    } catch (const ordered_json::exception& e) {
        fail("{}", e.what());
    }
}

/// The fixed nodes; empty if a mask is not available.
std::vector<std::int32_t> fixed_nodes(const Scene& scene, const TetMesh& mesh,
                                      const std::filesystem::path& source) {
    std::set<std::int32_t> nodes;
    try {
        for (const SelectionOptions& held : scene.fix)
            for (const std::int32_t n : select_located(mesh, held, "fix", source)) nodes.insert(n);
    } catch (const Error&) {
        return {};
    }
    return {nodes.begin(), nodes.end()};
}

/// Shows one in this many of the kept steps, the last, and all that did not converge.
std::size_t shown_every(const SolvedRun& run) { return run.kept_steps().size() / max_rows + 1; }

std::vector<const SolvedStep*> shown_steps(const SolvedRun& run) {
    const std::vector<const SolvedStep*> kept = run.kept_steps();
    std::vector<const SolvedStep*> shown;
    for (std::size_t k = 0; k < kept.size(); ++k)
        if ((k + 1) % shown_every(run) == 0 || k + 1 == kept.size() || !kept[k]->converged)
            shown.push_back(kept[k]);
    return shown;
}

std::string steps_note(const SolvedRun& run) {
    const std::size_t kept = run.kept_steps().size(), again = run.steps.size() - kept;
    std::string note;
    if (shown_every(run) > 1)
        note += fmt::format("One in {} of {}. ", shown_every(run), counted(kept, "step"));
    if (again > 0)
        note += fmt::format("{} more were tried, and repeated with other lengths. ", again);
    return note + "Imbalance: unbalanced forces relative to all forces.";
}

const char* end_of_step(const SolvedRun& run) {
    return run.is_static ? "share of load" : "time [s]";
}
const char* length_of_step(const SolvedRun& run) { return run.is_static ? "step" : "step [s]"; }

std::vector<std::pair<std::string, std::string>> run_rows(const SolveReport& r) {
    std::vector<std::pair<std::string, std::string>> rows{{"result", r.source}};
    rows.emplace_back("mesh", fmt::format("{}, {} nodes{}", r.elements, r.nodes,
                                          r.run ? ", " + counted(r.run->levels, "level") : ""));
    if (!r.cuts.empty()) rows.emplace_back("cuts", r.cuts);
    if (r.run) {
        rows.emplace_back("solver", r.run->solver);
        rows.emplace_back("ranks", fmt::format("{}", r.run->ranks));
        rows.emplace_back("seconds", fmt::format("mesh {:.2f}, set-up {:.2f}, solve {:.2f}",
                                                 r.run->mesh_s, r.run->setup_s, r.run->solve_s));
        rows.emplace_back("memory",
                          fmt::format("{:.0f} MB at the peak, all ranks", r.run->peak_bytes / 1e6));
        if (!r.run->version.empty()) rows.emplace_back("livetet", r.run->version);
    }
    rows.emplace_back("kept", r.has_load_shares()
                                  ? fmt::format("{}, at {:.4g} to {:.4g} of the load",
                                                counted(r.frames, "frame"), r.first_s, r.last_s)
                                  : fmt::format("{}, {:.4g} to {:.4g} s",
                                                counted(r.frames, "frame"), r.first_s, r.last_s));
    return rows;
}

}  // namespace

namespace {

SolvedTargets compare_with_truth(const ResultReader& result, const Truth& truth) {
    constexpr double least_motion = 0.003;  // m
    SolvedTargets found{.depth_mm = 1e3 * truth.depths.back(), .targets = truth.targets.size()};
    std::vector<Vector3> rest;
    for (const TruthTarget& t : truth.targets) rest.push_back(t.position);
    const std::vector<Vector3> u =
        PointSampler(result.mesh(), rest).sample(result.displacement(result.frame_count() - 1));
    double squares = 0, rigid_squares = 0;
    for (std::size_t i = 0; i < u.size(); ++i) {
        const Vector3& motion = truth.targets[i].displacement.back();
        if (motion.norm() <= least_motion) continue;
        ++found.moving;
        const double error = (u[i] - motion).norm();
        squares += error * error;
        rigid_squares += motion.squaredNorm();
        found.worst_mm = std::max(found.worst_mm, 1e3 * error);
    }
    if (found.moving == 0)
        fail("--truth: none of its {} targets moves by more than 3 mm, expected some",
             found.targets);
    const auto moving = static_cast<double>(found.moving);
    found.rms_mm = 1e3 * std::sqrt(squares / moving);
    found.rigid_rms_mm = 1e3 * std::sqrt(rigid_squares / moving);
    return found;
}

}  // namespace

std::vector<const SolvedStep*> SolvedRun::kept_steps() const {
    std::vector<const SolvedStep*> kept;
    for (const SolvedStep& s : steps)
        if (s.kept) kept.push_back(&s);
    return kept;
}

SolveReport make_solve_report(const ResultReader& result, const std::filesystem::path& source,
                              const Truth* truth) {
    if (result.frame_count() == 0)
        fail("{}: holds no frame, expected at least one", source.string());
    SolveReport r{.source = source.string(),
                  .scene_text = result.scene_text(),
                  .tets = result.mesh().tets.size(),
                  .nodes = result.mesh().nodes.size(),
                  .frames = result.frame_count(),
                  .elements = elements_text(result.mesh()),
                  .cuts = {},
                  .first_s = result.times_s().front(),
                  .last_s = result.times_s().back(),
                  .run = {},
                  .fixed = {},
                  .parts = {}};
    for (std::size_t k = 0; k < r.frames; ++k) {
        r.last_mm = 0;
        for (const Vector3& u : result.displacement(k))
            r.last_mm = std::max(r.last_mm, 1e3 * u.norm());
        if (r.last_mm > r.largest_mm) {
            r.largest_mm = r.last_mm;
            r.largest_frame = k;
        }
    }
    if (truth) r.truth = compare_with_truth(result, *truth);
    r.is_sweep = r.frames > 1 && result.has_text("registration");
    if (!result.has_text("solve")) return r;
    r.run = with_context(r.source + ": description of the solve",
                         [&] { return parse_run(result.text("solve")); });
    r.parts = explain_run(r.scene_text, r.source, r.tets, r.run->levels, r.run->solver, Use::solve);
    if (r.parts.empty()) return r;
    if (result.mesh().has_hexahedra()) r.parts.clear();  // they are of tetrahedra
    const Scene scene = read_yaml<Scene>(r.scene_text, r.source);
    r.cuts = cuts_text(scene, result.mesh());
    r.fixed = fixed_nodes(scene, result.mesh(), source);
    r.beyond_model = beyond_model(scene, result.mesh(), result.displacement(r.largest_frame));
    if (auto note = locking_note(scene)) r.beyond_model.push_back(std::move(*note));
    return r;
}

std::vector<std::string> verdicts(const SolveReport& r) {
    std::vector<std::string> sentences;
    if (r.run) {
        std::size_t newton_iterations = 0, iterations = 0;  // including rejected steps
        double time_error_mm = 0;
        for (const SolvedStep& s : r.run->steps) {
            newton_iterations += s.newton_iterations;
            iterations += s.iterations;
            if (s.kept) time_error_mm = std::max(time_error_mm, s.time_error_mm);
        }
        sentences.push_back(fmt::format(
            "{} in {}, {}, {} and {:.2f} s; final "
            "imbalance {:.1e}.",
            r.run->converged ? "Converged" : "NOT converged",
            counted(r.run->kept_steps().size(), "step"),
            counted(newton_iterations, "Newton iteration"), counted(iterations, "Krylov iteration"),
            r.run->solve_s, r.run->steps.empty() ? 0 : r.run->steps.back().imbalance));
        if (r.run->restarted_at_s > 0)
            sentences.push_back(fmt::format(
                "It was restarted at {:.4g} s: steps, iterations and seconds count from there.",
                r.run->restarted_at_s));
        if (!r.run->failure.empty())
            sentences.push_back(fmt::format("It ended so: {}.", r.run->failure));
        if (r.run->inverted_tets > 0)
            sentences.push_back(fmt::format(
                "{} {} inverted at the end: stresses there are meaningless; use a finer "
                "mesh or a smaller load.",
                counted(r.run->inverted_tets, "element"),
                r.run->inverted_tets == 1 ? "is" : "are"));
        if (time_error_mm > 0)
            sentences.push_back(
                fmt::format("Estimated error of a time step: at most {:.3g} mm.", time_error_mm));
    }
    sentences.push_back(
        r.frames > 1
            ? fmt::format(
                  "The body moves by {:.3f} mm at most, {:.3f} mm in the last of {} frames.",
                  r.largest_mm, r.last_mm, r.frames)
            : fmt::format("The body moves by {:.3f} mm at most.", r.largest_mm));
    if (r.truth)
        sentences.push_back(fmt::format(
            "Against the truth pressed by {:.0f} mm, the {} of {} targets that move more than 3 mm "
            "are {:.2f} mm RMS off in the last frame, {:.2f} mm at most; without deformation "
            "{:.2f} mm RMS.",
            r.truth->depth_mm, r.truth->moving, r.truth->targets, r.truth->rms_mm,
            r.truth->worst_mm, r.truth->rigid_rms_mm));
    sentences.insert(sentences.end(), r.beyond_model.begin(), r.beyond_model.end());
    return sentences;
}

std::string report_text(const SolveReport& r) {
    std::string out = "LIVETET: REPORT OF A SOLVE\n\n";
    for (const std::string& sentence : verdicts(r)) out += "  " + wrapped(sentence);
    out += "\nRUN\n";
    for (const auto& [name, value] : run_rows(r)) out += report_line(name, value);
    if (r.run && !r.run->forces_N.empty()) {
        out += "\nFORCES ON THE BODY [N]\n";
        for (const auto& [key, f] : r.run->forces_N)
            out +=
                report_line(key, fmt::format("{:>12.5g}{:>12.5g}{:>12.5g}", f.x(), f.y(), f.z()));
    }
    if (r.run && !r.run->steps.empty()) {
        out += fmt::format("\nSTEPS\n  {:>14}{:>10}{:>14}{:>14}{:>12}{:>17}{:>10}\n",
                           end_of_step(*r.run), length_of_step(*r.run), "Newton iters",
                           "Krylov iters", "imbalance", "time error [mm]", "took [s]");
        for (const SolvedStep* s : shown_steps(*r.run))
            out +=
                fmt::format("  {:>14.4g}{:>10.4g}{:>14}{:>14}{:>12.1e}{:>17.3g}{:>10.3f}{}\n",
                            s->time_s, s->step_s, s->newton_iterations, s->iterations, s->imbalance,
                            s->time_error_mm, s->seconds, s->converged ? "" : "  NOT");
        out += "  " + wrapped(steps_note(*r.run));
    }
    if (!r.parts.empty()) out += "\n" + parts_text(r.parts);
    return out;
}

std::string report_json(const SolveReport& r) {
    ordered_json out = {{"result", r.source},
                        {"verdicts", verdicts(r)},
                        {"tets", r.tets},
                        {"nodes", r.nodes},
                        {"frames", r.frames},
                        {"first_s", r.first_s},
                        {"last_s", r.last_s},
                        {"largest_displacement_mm", r.largest_mm},
                        {"last_displacement_mm", r.last_mm}};
    if (!r.cuts.empty()) out["cuts"] = r.cuts;
    if (r.truth)
        out["targets"] = {{"depth_mm", r.truth->depth_mm}, {"targets", r.truth->targets},
                          {"moving", r.truth->moving},     {"rms_mm", r.truth->rms_mm},
                          {"worst_mm", r.truth->worst_mm}, {"rigid_rms_mm", r.truth->rigid_rms_mm}};
    if (r.run) {
        ordered_json steps = ordered_json::array(), forces = ordered_json::object();
        for (const SolvedStep& s : r.run->steps)
            steps.push_back({{"time_s", s.time_s},
                             {"step_s", s.step_s},
                             {"converged", s.converged},
                             {"kept", s.kept},
                             {"linearisations", s.newton_iterations},
                             {"iterations", s.iterations},
                             {"imbalance", s.imbalance},
                             {"time_error_mm", s.time_error_mm},
                             {"seconds", s.seconds}});
        for (const auto& [key, f] : r.run->forces_N) forces[key] = {f.x(), f.y(), f.z()};
        out.update({{"solver", r.run->solver},
                    {"version", r.run->version},
                    {"levels", r.run->levels},
                    {"ranks", r.run->ranks},
                    {"converged", r.run->converged},
                    {"is_static", r.run->is_static},
                    {"restarted_at_s", r.run->restarted_at_s},
                    {"failure", r.run->failure},
                    {"inverted_tets", r.run->inverted_tets},
                    {"mesh_s", r.run->mesh_s},
                    {"setup_s", r.run->setup_s},
                    {"solve_s", r.run->solve_s},
                    {"peak_bytes", r.run->peak_bytes},
                    {"reactions_N", forces},
                    {"steps", steps},
                    {"parts", parts_json(r.parts)}});
    }
    return json_text(out);
}

std::string report_page(const SolveReport& r, std::span<const PagePicture> pictures,
                        const std::string& no_pictures) {
    HtmlSection run("The run");
    for (const auto& [name, value] : run_rows(r)) run.texts({name, value});
    std::string body;
    if (r.run && !r.run->forces_N.empty()) {
        HtmlSection s("Forces on the body [N]");
        s.heads({"", "x", "y", "z"});
        for (const auto& [key, f] : r.run->forces_N)
            s.row({key, fmt::format("{:.5g}", f.x()), fmt::format("{:.5g}", f.y()),
                   fmt::format("{:.5g}", f.z())});
        body += s.end();
    }
    if (r.run && !r.run->steps.empty()) {
        HtmlSection s("Steps");
        s.heads({end_of_step(*r.run), length_of_step(*r.run), "Newton iterations",
                 "Krylov iterations", "imbalance", "time error [mm]", "took [s]"});
        for (const SolvedStep* step : shown_steps(*r.run))
            s.row({fmt::format("{:.4g}{}", step->time_s, step->converged ? "" : " NOT converged"),
                   fmt::format("{:.4g}", step->step_s), fmt::format("{}", step->newton_iterations),
                   fmt::format("{}", step->iterations), fmt::format("{:.1e}", step->imbalance),
                   fmt::format("{:.3g}", step->time_error_mm),
                   fmt::format("{:.3f}", step->seconds)});
        body += s.end(steps_note(*r.run));
    }
    body += run.end();
    if (!r.parts.empty()) body += parts_html(r.parts);
    return html_page("Report of a solve", verdicts(r), pictures, no_pictures, body, r.scene_text);
}

}  // namespace livetet
