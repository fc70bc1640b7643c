#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/commands.hpp"
#include "apps/scene_body.hpp"
#include "base/file.hpp"
#include "config/yaml.hpp"
#include "io/points_csv.hpp"
#include "io/result_file.hpp"
#include "mesh/barycentric_map.hpp"
#include "solvers/petsc_session.hpp"

namespace livetet {

namespace {

using nlohmann::json;

struct SolveArguments {
    std::filesystem::path scene, json;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double largest_norm(const std::vector<Vector3>& values) {
    double largest = 0;
    for (const Vector3& v : values) largest = std::max(largest, v.norm());
    return largest;
}

/// Where displacements at the scene's probe points are read off.
struct Probes {
    std::vector<NamedPoint> points;
    BarycentricMap map;

    Probes(const ProbeOptions& options, const TetMesh& mesh) : points(read_points_csv(options.points)) {
        std::vector<Vector3> places;
        for (const NamedPoint& p : points) places.push_back(p.position);
        map = map_into(mesh, places);
        for (std::size_t i = 0; i < points.size(); ++i)
            if (map.distance[i] > 1e-3)
                fmt::print(stderr,
                           "probe {} lies {:.1f} mm outside the mesh; its nearest surface point stands for it\n",
                           points[i].name, 1e3 * map.distance[i]);
    }
    std::vector<Eigen::Vector3d> displacements(const std::vector<Vector3>& u) const {
        std::vector<Eigen::Vector3d> values;
        for (std::size_t i = 0; i < points.size(); ++i) values.push_back(interpolate(map, i, u));
        return values;
    }
};

/// One step after another to the scene's end; `keep` is called with each that is to be kept.
template <class Keep>
json run_steps(const Scene& scene, SceneBody& scene_body, ProgressLine* progress, Keep&& keep) {
    DeformableBody& body = *scene_body.body;
    const bool is_static = scene.time.scheme == TimeScheme::static_equilibrium;
    const int steps = is_static ? scene.time.load_steps
                                : std::max(1, static_cast<int>(std::lround(scene.time.duration_s / scene.time.step_s)));
    const std::vector<Vector3> force = scene_forces(scene, scene_body.mesh());
    std::vector<Vector3> scaled = force;
    SceneConstraints scene_constraints(scene, scene_body.mesh());
    Constraints constraints = scene_constraints.at(std::numeric_limits<double>::infinity());
    const std::vector<Eigen::Vector3d> full = constraints.values;
    json history = json::array();
    for (int step = 1; step <= steps; ++step) {
        const double fraction = static_cast<double>(step) / steps;
        const double time = is_static ? fraction : step * scene.time.step_s;  // static: the share of the load
        if (is_static) {
            for (std::size_t n = 0; n < full.size(); ++n) {
                constraints.values[n] = fraction * full[n];
                scaled[n] = fraction * force[n];
            }
        } else {
            constraints = scene_constraints.at(time);
        }
        body.set_constraints(constraints);
        body.set_external_force(scaled);
        const StepReport report = body.step(scene.time.step_s, batch_effort(scene));
        history.push_back({{"time_s", time},
                           {"converged", report.converged},
                           {"linearisations", report.linearisations},
                           {"iterations", report.iterations},
                           {"imbalance", report.imbalance},
                           {"seconds", report.forces_s + report.operator_s + report.solve_s}});
        if (progress)
            progress->update(
                fraction, fmt::format("step {} of {}: {} linearisations, {} iterations, imbalance {:.1e}", step, steps,
                                      report.linearisations, report.iterations, report.imbalance));
        if (step % scene.output.every == 0 || step == steps) keep(time, body.displacement());
    }
    return history;
}

int solve(const SolveArguments& arguments, const std::vector<std::string>& petsc) {
    // 1. what is asked
    Scene scene = load_scene(arguments.scene);
    PetscSession session("livetet", petsc);
    session.add_options(scene.solver.petsc_options);
    const bool first = session.rank() == 0;
    std::optional<ProgressLine> progress;
    if (first) progress.emplace("solve");

    // 2. mesh, body
    const auto start = std::chrono::steady_clock::now();
    MeshHierarchy hierarchy = load_mesh(scene.mesh, progress ? progress->callback() : ProgressCallback{});
    const double mesh_s = seconds_since(start);
    SceneBody scene_body = make_body(PETSC_COMM_WORLD, scene, std::move(hierarchy));
    const double setup_s = seconds_since(start) - mesh_s;
    std::optional<Probes> probes;
    if (scene.probes) probes.emplace(*scene.probes, scene_body.mesh());

    // 3. steps, kept as the scene says
    std::optional<ResultWriter> writer;
    if (first) writer.emplace(scene.output.file, scene_body.mesh(), to_yaml(scene));
    std::vector<Vector3> last;
    const json history =
        run_steps(scene, scene_body, progress ? &*progress : nullptr, [&](double time, std::vector<Vector3> u) {
            last = std::move(u);
            if (writer) writer->append(time, last);
        });
    progress.reset();
    const bool converged =
        std::all_of(history.begin(), history.end(), [](const json& h) { return h["converged"].get<bool>(); });
    if (!first) return converged ? 0 : 3;

    // 4. results
    writer->close();
    if (probes) write_displacements_csv(scene.probes->displacements, probes->points, probes->displacements(last));
    int iterations = 0, linearisations = 0;
    double solve_s = 0;
    for (const json& h : history) {
        iterations += h["iterations"].get<int>();
        linearisations += h["linearisations"].get<int>();
        solve_s += h["seconds"].get<double>();
    }
    fmt::print("mesh             {} tets, {} nodes, {} level(s)\n", scene_body.mesh().tets.size(),
               scene_body.mesh().nodes.size(), scene_body.hierarchy.levels.size());
    fmt::print("ranks            {}\n", session.ranks());
    fmt::print("displacement     {:.4f} mm at most\n", 1e3 * largest_norm(last));
    fmt::print("solver           {} step(s), {} linearisations, {} iterations, {}\n", history.size(), linearisations,
               iterations, converged ? "converged" : "NOT converged");
    fmt::print("imbalance        {:.2e} (last step)\n", history.back()["imbalance"].get<double>());
    fmt::print("seconds          mesh {:.2f}, set-up {:.2f}, solve {:.2f}\n", mesh_s, setup_s, solve_s);
    fmt::print("written          {}{}\n", scene.output.file.string(),
               probes ? ", " + scene.probes->displacements.string() : "");
    if (!arguments.json.empty())
        write_text_file(arguments.json, json{{"tets", scene_body.mesh().tets.size()},
                                             {"nodes", scene_body.mesh().nodes.size()},
                                             {"levels", scene_body.hierarchy.levels.size()},
                                             {"ranks", session.ranks()},
                                             {"largest_displacement_mm", 1e3 * largest_norm(last)},
                                             {"converged", converged},
                                             {"iterations", iterations},
                                             {"linearisations", linearisations},
                                             {"mesh_s", mesh_s},
                                             {"setup_s", setup_s},
                                             {"solve_s", solve_s},
                                             {"steps", history}}
                                                .dump(2) +
                                            "\n");
    return converged ? 0 : 3;
}

}  // namespace

void add_solve_command(CLI::App& app, ExitStatus& status) {
    CLI::App* command = app.add_subcommand("solve", "Solves a scene, static or dynamic, on one rank or under mpirun");
    command->footer(
        "Other options with one dash go to PETSc: -ksp_view, -log_view, -ksp_monitor ...\nThe keys of a scene: livetet "
        "scene.");
    auto arguments = std::make_shared<SolveArguments>();
    command->add_option("scene", arguments->scene, "scene file (YAML)")->required();
    command->add_option("--json", arguments->json, "write the figures to this file too");
    command->allow_extras();
    command->callback([command, arguments, &status] { status.value = solve(*arguments, petsc_arguments(*command)); });
}

}  // namespace livetet
