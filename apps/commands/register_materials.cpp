#include "apps/commands/register_materials.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "apps/commands/measured_landmarks.hpp"
#include "apps/scene/outputs.hpp"
#include "apps/simulation/checkpoint.hpp"
#include "apps/simulation/material_fit.hpp"
#include "apps/simulation/measured_organ.hpp"
#include "apps/simulation/result_fields.hpp"
#include "apps/simulation/run_description.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/stopwatch.hpp"
#include "config/yaml.hpp"
#include "io/result_file.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

using nlohmann::json;

void check_material_arguments(const RegisterArguments& a) {
    const std::pair<const char*, bool> idle[] = {{"--tracker", !a.tracker.empty()},
                                                 {"--surface", !a.surface.empty()},
                                                 {"--surface-points", !a.surface_points.empty()},
                                                 {"--later-points", !a.follow.later_points.empty()},
                                                 {"--deform", !a.scene.empty()},
                                                 {"--output", !a.output.empty()},
                                                 {"--live", a.follow.live},
                                                 {"--publish", !a.follow.publish.empty()}};
    for (const auto& [name, given] : idle)
        if (given) fail("{}: has no effect with --materials, expected --landmarks", name);
    if (a.landmarks.empty() || a.image.empty())
        fail(
            "--materials {}: expected --landmarks with named points of the loaded body, and "
            "--image with the same at rest",
            a.materials.scene.string());
}

json describe_fit(const MaterialFit& fit, std::size_t landmarks) {
    json values = json::array();
    for (const FoundValue& v : fit.values)
        values.push_back({{"key", v.sought.key},
                          {"start", v.sought.start},
                          {"value", v.value},
                          {"low_95", v.low_95},
                          {"high_95", v.high_95},
                          {"spread_ratio", v.spread_ratio},
                          {"determined", v.is_determined()}});
    return {{"landmarks", landmarks},
            {"converged", fit.converged},
            {"reason", fit.reason},
            {"iterations", fit.iterations},
            {"rms_before_mm", 1e3 * fit.rms_before_m},
            {"rms_mm", 1e3 * fit.rms_m},
            {"values", values}};
}

void print_fit(const MaterialFit& fit, std::size_t landmarks, const std::string& written,
               double seconds) {
    fmt::print("landmarks        {}: {:.2f} mm RMS before, {:.2f} mm after\n", landmarks,
               1e3 * fit.rms_before_m, 1e3 * fit.rms_m);
    fmt::print("iterations       {}, {}\n", fit.iterations,
               fit.converged ? "converged" : "NOT converged");
    fmt::print("{:<32}{:>12}{:>12}{:>12}{:>12}\n", "value", "before", "found", "95 % from", "to");
    for (const FoundValue& v : fit.values)
        fmt::print("{:<32}{:>12.4g}{:>12.4g}{:>12.4g}{:>12.4g}{}\n", v.sought.key, v.sought.start,
                   v.value, v.low_95, v.high_95,
                   v.is_determined()
                       ? ""
                       : fmt::format("  not determined: {:.0f} % of the spread before",
                                     100 * v.spread_ratio));
    fmt::print("seconds          {:.2f}\nwritten          {}\n", seconds, written);
}

/// Writes the equilibrium found, as `solve` does, under the scene with the values found.
void write_fitted(const MaterialFit& fit, const json& about) {
    ResultWriter writer(fit.scene.output.file, fit.body->mesh(), to_yaml(fit.scene));
    append_frame(writer,
                 {1, fit.body->body->displacement(), result_fields(fit.scene, *fit.body->body)});
    writer.write_text("solve", about.dump());
    writer.write_text("materials", about["materials"].dump());
    writer.close();
}

}  // namespace

int register_materials(const RegisterArguments& a) {
    PetscSession session("livetet", {});
    if (session.ranks() > 1)
        fail("register --materials: runs on one rank, found {}", session.ranks());
    check_material_arguments(a);
    const Scene scene = load_scene(a.materials.scene);
    refuse_to_overwrite("--json", a.json, scene, a.materials.scene);
    refuse_to_overwrite("--json", a.json, {a.landmarks, a.registration, a.image});
    if (!a.json.empty()) expect_writable(a.json);
    session.add_options(scene.solver.petsc_options);
    const std::vector<SoughtValue> sought = sought_values(scene, a.materials.support);
    std::vector<MeasuredLandmark> landmarks = matched_landmarks(a);
    if (!a.registration.empty()) map_landmarks(read_registration(a.registration), landmarks);

    std::optional<ProgressLine> progress;
    progress.emplace("register");
    RunFigures figures;
    const auto start = std::chrono::steady_clock::now();
    const MeshHierarchy hierarchy = load_mesh(scene, progress->callback());
    refuse_hexahedra(hierarchy, "register --materials");
    check_landmarks(landmarks, hierarchy.levels.front().nodes);
    figures.mesh_s = seconds_since(start);
    const MaterialFit fit =
        fit_materials(scene, hierarchy, landmarks, sought, progress->callback());
    progress.reset();

    figures.sum = sum_of(fit.history);
    for (const Vector3& u : fit.body->body->displacement())
        figures.largest_displacement_m = std::max(figures.largest_displacement_m, u.norm());
    figures.inverted_tets = fit.body->body->inverted_tets();
    RunHistory history = fit.history;
    history.converged = fit.converged;
    if (!fit.converged)
        history.failure = fmt::format("the values did not converge in {} ({})",
                                      counted(fit.iterations, "iteration"), fit.reason);
    json about = describe_run(fit.scene, *fit.body, history, figures, 0);
    about["materials"] = describe_fit(fit, landmarks.size());
    if (scene.output.has_file()) write_fitted(fit, about);
    if (!a.json.empty()) write_text_file(a.json, about.dump(2) + "\n");
    print_fit(
        fit, landmarks.size(),
        scene.output.has_file() ? scene.output.file.string() : "no result (output.file: none)",
        seconds_since(start));
    if (!fit.converged) fmt::print(stderr, "livetet: {}\n", history.failure);
    return fit.converged ? 0 : 3;
}

}  // namespace livetet
