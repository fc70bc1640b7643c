#include "apps/scene/explanation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/scene/mesh_grading.hpp"
#include "apps/scene/model_limits.hpp"
#include "base/error.hpp"
#include "config/yaml.hpp"
#include "solvers/linear/live_support.hpp"

namespace livetet {

namespace {

/// Collects the parts that a scene builds and leaves out.
class Explanation {
  public:
    void uses(std::string_view part, const std::string& why) {
        parts.push_back({true, std::string(part), why});
    }
    void leaves_out(std::string_view part, const std::string& why) {
        parts.push_back({false, std::string(part), why});
    }
    std::vector<ExplainedPart> parts;
};

/// The keys by which a scene states that a value may be off.
std::vector<std::string> stated_spreads(const Scene& scene) {
    std::vector<std::string> keys;
    const auto note = [&](bool is_stated, std::string_view list, std::size_t i, const char* key) {
        if (is_stated) keys.push_back(fmt::format("{}[{}].{}", list, i, key));
    };
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        note(scene.materials[i].young_Pa.spread > 0, "materials", i, "young_Pa");
        note(scene.materials[i].poisson.spread > 0, "materials", i, "poisson");
    }
    for (std::size_t i = 0; i < scene.fix.size(); ++i) {
        const auto& stiffness = scene.fix[i].stiffness_N_per_m;
        note(stiffness && stiffness->spread > 0, "fix", i, "stiffness_N_per_m");
        note(scene.fix[i].spread_mm > 0, "fix", i, "spread_mm");
    }
    if (!scene.track) return keys;
    for (std::size_t i = 0; i < scene.track->sensors.size(); ++i)
        note(scene.track->sensors[i].patch_spread_mm.has_value(), "track.sensors", i,
             "patch_spread_mm");
    return keys;
}

void explain_spreads(Explanation& e, const Scene& scene) {
    if (scene.track && !scene.track->targets.empty()) return;
    if (const auto keys = stated_spreads(scene); !keys.empty())
        e.leaves_out("spreads",
                     fmt::format("no effect without track.targets: {}", fmt::join(keys, ", ")));
}

void explain_slips(Explanation& e, const TrackOptions& track) {
    const std::vector<SensorOptions>& sensors = track.sensors;
    const bool solves = sensors.size() > 1 && track.targets.empty();
    const auto loose =
        std::ranges::count_if(sensors, [](const SensorOptions& s) { return s.may_slip; });
    if (loose > 0)
        e.uses(
            "slip monitor",
            fmt::format(
                "{} of {} sensor(s): one that slips over the organ is let go and placed "
                "anew{}",
                loose, sensors.size(),
                solves ? "; after one is placed or released, or fix has changed, a frame sets up a "
                         "second body, and some later ones make a static solve each"
                       : ""));
    else
        e.leaves_out("slip monitor",
                     sensors.empty() ? "no sensors" : "track.sensors: may_slip is false");
}

/// Nothing if neither the mesh is graded nor a place is stated that it could be graded by.
void explain_grading(Explanation& e, const Scene& scene) {
    const SceneGrading grading = grading_by(scene);
    std::vector<std::string> keys;
    for (const auto& [key, patch] : grading.patches) keys.push_back(key);
    const bool is_planned =
        scene.track && std::ranges::any_of(scene.track->sensors, [](const SensorOptions& s) {
            return s.place_mm.has_value();
        });
    if (scene.mesh.grading == MeshGrading::scene)
        e.uses("graded mesh",
               fmt::format("edges of {} times the others at {}{}", PatchGrading{}.ratio,
                           fmt::join(keys, ", "),
                           grading.without_place.empty()
                               ? ""
                               : fmt::format("; not stated are the places of {}",
                                             fmt::join(grading.without_place, ", "))));
    else if (is_planned)
        e.leaves_out("graded mesh",
                     "mesh.grading is not scene: place_mm tells what it costs to place a sensor "
                     "elsewhere");
}

void explain_tracking(Explanation& e, const Scene& scene) {
    if (!scene.track) return e.leaves_out("tracker", "no track section: no thread, no filter");
    e.uses("tracker", fmt::format("`track` only: {} sensor(s); a thread each for the source, "
                                  "the result file, the status "
                                  "line and the scene file",
                                  scene.track->sensors.size()));
    if (const int iterations = newton_iterations_of_frame(scene); iterations > 1)
        e.uses("Newton iterations",
               fmt::format("{} a frame: {}", iterations,
                           scene.track->newton_iterations
                               ? "track.linearisations"
                               : "newmark near nu = 0.5: with one the body may keep swinging"));
    if (!scene.track->smoothing_Hz)
        e.uses("pose estimator",
               fmt::format("for a tracker with errors of {} mm and {} degrees, RMS{}",
                           scene.track->position_noise_mm, scene.track->rotation_noise_deg,
                           scene.track->ahead_ms && scene.track->ahead_ms->is_auto()
                               ? "; predicts to the time at which the frame is shown"
                               : ""));
    else if (*scene.track->smoothing_Hz > 0)
        e.uses("pose filter", fmt::format("one-euro, {} Hz at rest", *scene.track->smoothing_Hz));
    else
        e.leaves_out("pose smoothing", "track.smoothing_Hz is 0");
    explain_slips(e, *scene.track);
    if (scene.track->targets.empty()) {
        e.leaves_out("error statement", "track.targets is empty");
    } else {
        e.uses("error statement",
               "track.targets: after a sensor is placed or released, or fix has changed, some "
               "frames set up a second body or make a static solve each");
        if (scene.output.has_file())
            e.uses("surface statement",
                   "track.targets: the error over the organ's surface, a sixth of it each frame");
        else
            e.leaves_out("surface statement", "output.file: none; `view` builds it");
    }
    if (scene.track->publish)
        e.uses("OpenIGTLink server",
               fmt::format("track.publish: port {}", scene.track->publish->port));
    else
        e.leaves_out("OpenIGTLink server", "no track.publish, no --publish: no socket");
}

}  // namespace

std::vector<ExplainedPart> explain_parts(const Scene& scene, std::size_t tets, std::size_t levels,
                                         SolverKind kind) {
    const bool is_static = !scene.time.is_dynamic();
    const bool multigrid = kind == SolverKind::multigrid || kind == SolverKind::live;
    Explanation e;
    e.uses("elements",
           fmt::format("{} tetrahedra of {} nodes", tets, scene.elements == Elements::p2 ? 10 : 4));
    explain_grading(e, scene);
    for (const Material& m : scene.materials)
        e.uses("material",
               fmt::format("{}: {}, {} Pa, Poisson's ratio {}",
                           m.region == 0 ? "all other regions" : fmt::format("region {}", m.region),
                           model_of(m, scene.strain).names().title, m.young_Pa, m.poisson));
    const ChosenFormulation formulation = choose_formulation(elastic_model(scene));
    if (formulation.formulation == Formulation::mixed)
        e.uses("pressures",
               "one at each corner, FGMRES around the preconditioner of the displacements");
    else
        e.leaves_out("pressures", locking_note(scene).value_or(formulation.reason));
    const bool turns_preconditioner =
        kind == SolverKind::live && !is_small_strain(scene.materials, scene.strain);
    if (!has_corotated(scene.materials, scene.strain) && turns_preconditioner)
        e.uses("rotations", "one for each tetrahedron: the preconditioner turns with it");
    else if (!has_corotated(scene.materials, scene.strain))
        e.leaves_out("rotations", "no material is corotated");
    else
        e.uses("rotations",
               fmt::format("one for each quadrature point, each Newton iteration: about {:.0f} ms",
                           (scene.elements == Elements::p2 ? 1e-3 : 2.5e-5) * tets));
    if (is_small_strain(scene.materials, scene.strain))
        e.uses("one operator",
               "small strain: kept, with what it was factored to, while the step, constraints and "
               "springs are the same");
    if (is_static)
        e.leaves_out("mass, velocities", "time.scheme: static");
    else
        e.uses("mass, velocities",
               fmt::format("lumped mass; time.scheme, step {} s", scene.time.step_s));
    if (is_static || (scene.time.rayleigh_alpha == 0 && scene.time.rayleigh_beta == 0))
        e.leaves_out("damping",
                     is_static ? "time.scheme: static" : "rayleigh_alpha and rayleigh_beta are 0");
    else
        e.uses("damping", fmt::format("Rayleigh, alpha {} 1/s, beta {} s",
                                      scene.time.rayleigh_alpha, scene.time.rayleigh_beta));
    if (scene.gravity_m_per_s2 == Vector3::Zero() && scene.loads.empty())
        e.leaves_out("forces", "no gravity, no loads");
    else
        e.uses("forces", fmt::format("{}{} load(s)",
                                     scene.gravity_m_per_s2 == Vector3::Zero() ? "" : "gravity, ",
                                     scene.loads.size()));
    const bool galerkin = resolved_coarse(scene.solver.coarse, contrast_of(scene.materials)) ==
                          CoarseOperator::galerkin;
    if (multigrid)
        e.uses("coarse levels", fmt::format("{} of them, {}", levels - 1,
                                            galerkin ? "P^T A P each Newton iteration"
                                                     : "assembled with their own rotations"));
    else
        e.leaves_out("coarse levels",
                     levels > 1 ? "solver.kind is not multigrid" : "the mesh has one level");
    explain_tracking(e, scene);
    explain_spreads(e, scene);
    if (scene.probes)
        e.uses("probes", scene.probes->points.string());
    else
        e.leaves_out("probes", "no probes section");
    if (scene.output.has_file())
        e.uses("result file", scene.output.file.string());
    else
        e.leaves_out("result file", "output.file: none");
    if (scene.materials.size() == 1) e.leaves_out("regions", "one material");
    return std::move(e.parts);
}

ExplainedPart explain_live(const Scene& scene, const MeshHierarchy& hierarchy) {
    if (scene.solver.kind != SolverKind::automatic && scene.solver.kind != SolverKind::live)
        return {false, "live solver", "solver.kind names another"};
    const std::string reason = why_not_live(elastic_model(scene), hierarchy);
    return {reason.empty(), "live solver",
            !reason.empty() ? reason
            : resolved_formulation(elastic_model(scene)) == Formulation::mixed
                ? "FGMRES around multigrid in single precision and a pressure mass"
                : "conjugate gradients around multigrid in single precision"};
}

std::vector<ExplainedPart> explain_run(const std::string& scene_text, const std::string& source,
                                       std::size_t tets, std::size_t levels,
                                       const std::string& solver, Use use) {
    if (scene_text.empty()) return {};
    try {
        Scene scene = read_yaml<Scene>(scene_text, source);
        if (use == Use::solve) scene.track.reset();
        const bool multigrid = solver.find("multigrid") != std::string::npos ||
                               solver.find(" mg,") != std::string::npos;
        return explain_parts(scene, tets, levels,
                             solver.find("single precision") != std::string::npos ? SolverKind::live
                             : multigrid ? SolverKind::multigrid
                                         : SolverKind::petsc);
    } catch (const Error&) {
        return {};
    }
}

}  // namespace livetet
