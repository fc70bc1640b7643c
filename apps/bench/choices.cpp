#include "apps/bench/choices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "apps/scene/body_factory.hpp"
#include "base/error.hpp"
#include "io/hierarchy_file.hpp"
#include "solvers/linear/live_support.hpp"

namespace livetet {

namespace {

constexpr double tightest = 1e-9;
constexpr int finer_in_time = 4;

constexpr std::array<std::pair<TimeScheme, const char*>, 3> schemes{
    {{TimeScheme::implicit_euler, "Euler"},
     {TimeScheme::newmark, "Newmark"},
     {TimeScheme::generalized_alpha, "generalized-alpha"}}};

/// The linear tolerance that goes with a Newton tolerance: a linear solve need not outdo the last
/// Newton iteration.
void solve_to(Scene& scene, double tolerance) {
    scene.solver.newton_tolerance = tolerance;
    scene.solver.relative_tolerance = std::max(1e-3, std::min(0.1, tolerance));
}

std::string digits(double tolerance) { return fmt::format("{:.0e}", tolerance); }

}  // namespace

Choices::Choices(const Scene& scene, MeshHierarchy hierarchy, const std::filesystem::path& folder)
    : scene_(scene), hierarchy_(std::move(hierarchy)), folder_(folder) {
    scene_.track.reset();
    scene_.output = {};
    scene_.mesh = {};
    if (scene_.time.adaptive_tolerance_mm > 0)
        fail(
            "time.adaptive_tolerance_mm is set, expected fixed steps: they are one of the choices");
    MeshHierarchy rest = hierarchy_;
    for (std::size_t l = 0; l < hierarchy_.levels.size(); ++l) {
        write_hierarchy(folder_ / fmt::format("level{}.h5", l), rest);
        rest.levels.erase(rest.levels.begin());
        if (!rest.transfers.empty()) rest.transfers.erase(rest.transfers.begin());
        if (!rest.parents.empty()) rest.parents.erase(rest.parents.begin());
    }
}

SceneChoice Choices::on_level(std::size_t level) const {
    SceneChoice choice{"", fmt::format("level {}", level), level, scene_};
    choice.scene.mesh.file = folder_ / fmt::format("level{}.h5", level);
    if (level + 1 == hierarchy_.levels.size())
        choice.scene.solver.kind = SolverKind::automatic;  // nothing below for multigrid
    return choice;
}

std::vector<SceneChoice> Choices::all() const {
    std::vector<SceneChoice> all;
    const auto add = [&](SceneChoice choice, const std::string& varied, const std::string& name,
                         auto&& change) {
        choice.varied = varied;
        choice.name += ", " + name;
        change(choice.scene);
        all.push_back(std::move(choice));
    };
    constexpr double usual = 1e-4;
    const std::size_t levels = hierarchy_.levels.size();
    for (const Elements elements : {Elements::p1, Elements::p2})
        for (const double tolerance : {1e-1, 1e-2, usual})
            for (std::size_t l = elements == Elements::p2 ? 1 : 0; l < levels; ++l) {
                const std::string order = elements == Elements::p2 ? "P2" : "P1";
                add(on_level(l), fmt::format("{}, to {}", order, digits(tolerance)),
                    fmt::format("{}, {}", order, digits(tolerance)), [&](Scene& s) {
                        s.elements = elements;
                        solve_to(s, tolerance);
                    });
            }
    const auto with = [&](const std::string& varied, const std::string& name, auto&& change) {
        add(on_level(0), varied, "P1, " + name, [&](Scene& s) {
            s.elements = Elements::p1;
            solve_to(s, usual);
            change(s);
        });
    };
    for (const Choice<ModelChoice>& model : models_without_keys())
        if (model.value != scene_.strain)
            with("strain model", std::string(model.value->names().title),
                 [&](Scene& s) { s.strain = model.value; });
    if (levels > 1)
        with("solver", "multigrid, Galerkin", [](Scene& s) {
            s.solver.kind = SolverKind::multigrid;
            s.solver.coarse = CoarseOperator::galerkin;
        });
    Scene live = scene_;
    live.formulation = Formulation::displacement;
    if (why_not_live(elastic_model(live), hierarchy_).empty())
        with("solver", "live kernels", [](Scene& s) {
            s.solver.kind = SolverKind::live;
            s.formulation = Formulation::displacement;
        });
    with("solver", "BoomerAMG", [](Scene& s) { s.solver.kind = SolverKind::boomeramg; });
    with("solver", "GAMG", [](Scene& s) { s.solver.kind = SolverKind::gamg; });
    with("solver", "Cholesky", [](Scene& s) { s.solver.kind = SolverKind::direct; });
    with("solver", "ICC", [](Scene& s) {
        s.solver.kind = SolverKind::petsc;
        s.solver.max_iterations = 2000;
        const bool mixed = resolved_formulation(elastic_model(s)) == Formulation::mixed;
        s.solver.petsc_options =
            mixed ? "-fieldsplit_displacement_pc_type icc" : "-ksp_type cg -pc_type icc";
    });
    if (scene_.time.is_dynamic())
        for (const auto& [scheme, name] : schemes)
            for (const int longer : {1, 2, 4})
                if (scheme != scene_.time.scheme || longer != 1)
                    with(name,
                         fmt::format("{}, {:.3g} ms", name, 1e3 * longer * scene_.time.step_s),
                         [&](Scene& s) {
                             s.time.scheme = scheme;
                             s.time.step_s *= longer;
                         });
    return all;
}

Scene Choices::tight(const SceneChoice& choice) const {
    Scene s = choice.scene;
    s.solver = on_level(choice.level).scene.solver;
    s.formulation = choice.scene.formulation;
    solve_to(s, tightest);
    return s;
}

Scene Choices::fine_in_time(const SceneChoice& choice) const {
    Scene s = tight(choice);
    s.time = scene_.time;
    if (s.time.is_dynamic()) s.time.step_s /= finer_in_time;
    return s;
}

Scene Choices::same_model(const SceneChoice& choice) const {
    Scene s = fine_in_time(choice);
    s.strain = scene_.strain;
    s.formulation = scene_.formulation;
    return s;
}

Scene Choices::reference() const {
    SceneChoice finest = on_level(0);
    finest.scene.elements = Elements::p2;
    return same_model(finest);
}

}  // namespace livetet
