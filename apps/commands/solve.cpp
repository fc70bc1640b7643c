#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/commands/commands.hpp"
#include "apps/scene/model_limits.hpp"
#include "apps/scene/outputs.hpp"
#include "apps/scene/probes.hpp"
#include "apps/simulation/run_description.hpp"
#include "apps/simulation/state_keeper.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/log.hpp"
#include "base/stopwatch.hpp"
#include "io/points_csv.hpp"
#include "mesh/quadratic.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

using nlohmann::json;

struct SolveArguments {
    std::filesystem::path scene, json;
    bool restart = false, profile = false;
};

double largest_norm(const std::vector<Vector3>& values) {
    double largest = 0;
    for (const Vector3& v : values) largest = std::max(largest, v.norm());
    return largest;
}

/// Checks what can be checked before anything runs. Collective.
void check_files(const SolveArguments& arguments, const Scene& scene, bool first) {
    refuse_to_overwrite("--json", arguments.json, scene, arguments.scene);
    for (const std::filesystem::path& path :
         {arguments.json, scene.probes ? scene.probes->displacements : std::filesystem::path()})
        if (first && !path.empty()) (void)PendingFile(path);  // throws if it cannot be written
}

void print_figures(const SceneBody& body, const RunHistory& history, const RunFigures& figures) {
    fmt::print("mesh             {} tets, {} nodes, {}\n", body.mesh().tets.size(),
               body.mesh().nodes.size(), counted(body.hierarchy.levels.size(), "level"));
    fmt::print("ranks            {}\n", figures.ranks);
    fmt::print("displacement     {:.4f} mm at most\n", 1e3 * figures.largest_displacement_m);
    fmt::print("solver           {}\n", body.body->linear_solver().name());
    fmt::print("steps            {}, {}, {}, {}\n", history.steps.size(),
               counted(figures.sum.newton_iterations, "Newton iteration"),
               counted(figures.sum.iterations, "Krylov iteration"),
               history.converged ? "converged" : "NOT converged");
    if (!history.steps.empty()) {  // a time limit may end a run before its first step
        const StepReport& last = history.steps.back().report;
        fmt::print("imbalance        {:.2e}, allowed {:.2e} (last step)\n", last.imbalance,
                   last.allowed_imbalance);
    }
    if (figures.inverted_tets > 0)
        fmt::print(
            "inverted         {}: stresses there are meaningless; use a finer mesh or a smaller "
            "load\n",
            counted(figures.inverted_tets, "tet"));
    for (const std::string& sentence : figures.beyond_model)
        fmt::print("warning          {}\n", sentence);
    for (const auto& [key, force] : figures.forces)
        fmt::print("{:<16} ({:.4g}, {:.4g}, {:.4g}) N on the body\n", key, force.x(), force.y(),
                   force.z());
    fmt::print("seconds          mesh {:.2f}, set-up {:.2f}, solve {:.2f}\n", figures.mesh_s,
               figures.setup_s, figures.sum.seconds());
}

/// Says that a mesh is too small for its ranks: they wait for each other longer than they work.
void warn_of_small_parts(std::size_t tets, int ranks) {
    constexpr std::size_t min_tets = 5000;  // of a rank
    const std::size_t useful = std::max<std::size_t>(1, tets / min_tets);
    if (static_cast<std::size_t>(ranks) > useful)
        log_warning(
            fmt::format("{} tets on {} ranks: found {} tets a rank, expected {} or more: "
                        "{} would be as fast",
                        tets, ranks, tets / ranks, min_tets, counted(useful, "rank")));
}

/// Which files hold the run's results.
std::string written_text(const Scene& scene, bool has_state) {
    if (!has_state) return "nothing: no state was reached";
    const std::string result =
        scene.output.has_file() ? scene.output.file.string() : "no result (output.file: none)";
    return scene.probes ? result + ", " + scene.probes->displacements.string() : result;
}

/// Returns the exit status: 3 if the run did not converge.
int solve(const SolveArguments& arguments, const std::vector<std::string>& petsc) {
    // 1. inputs
    PetscSession session("livetet", petsc);  // first, so that only one rank reports an error
    const Scene scene = load_scene(arguments.scene);
    const bool first = session.rank() == 0;
    check_files(arguments, scene, first);
    session.add_options(scene.solver.petsc_options);
    std::optional<ProgressLine> progress;
    if (first) progress.emplace("solve");
    const auto callback = [&] { return progress ? progress->callback() : ProgressCallback{}; };

    if (const auto note = locking_note(scene); note && first) log_warning(*note);

    // 2. mesh, body
    RunFigures figures;
    figures.ranks = session.ranks();
    const auto start = std::chrono::steady_clock::now();
    MeshHierarchy hierarchy = load_mesh(scene, callback());
    figures.mesh_s = seconds_since(start);
    SceneBody body = make_body(PETSC_COMM_WORLD, scene, std::move(hierarchy), Use::solve);
    SceneConstraints constraints(scene, body.mesh());
    check_no_free_motion(scene, body.mesh(), constraints);
    figures.setup_s = seconds_since(start) - figures.mesh_s;
    std::optional<Probes> probes;
    if (scene.probes) probes.emplace(*scene.probes, body.mesh());

    if (first) warn_of_small_parts(body.mesh().tets.size(), session.ranks());

    // 3. steps
    StateKeeper states(scene, body, arguments.restart ? RunStart::from_checkpoint : RunStart::anew);
    RunHooks hooks = states.hooks(callback());
    hooks.iterated = [&] { session.tell_unused_options(PetscSession::Moment::set_up); };
    const RunHistory history = run_scene(scene, body, constraints, hooks);
    progress.reset();
    const std::vector<Vector3>& displacement = states.displacement();
    figures.forces = constraints.forces(body.body->reactions(), displacement);
    figures.inverted_tets = body.body->inverted_tets();
    figures.largest_displacement_m = largest_norm(displacement);
    if (first) figures.beyond_model = beyond_model(scene, body.mesh(), displacement);
    figures.sum = sum_of(history);
    if (arguments.profile)
        figures.profile = solve_profile(PETSC_COMM_WORLD, scene, body, figures.mesh_s,
                                        {0, states.output_s(), static_cast<long>(states.frames())});

    // 4. results
    json about = describe_run(scene, body, history, figures, states.start_s());
    states.close(about.dump());
    session.tell_unused_options(PetscSession::Moment::end);
    const int status = history.converged ? 0 : 3;
    if (!first) return status;
    states.remove_checkpoints();
    const bool has_state = states.frames() > 0;
    if (probes && has_state)
        write_displacements_csv(scene.probes->displacements, probes->points,
                                probes->sampler.sample(displacement));
    about["output_s"] = states.output_s();
    print_figures(body, history, figures);
    fmt::print("written          {}\n", written_text(scene, has_state));
    if (arguments.profile) fmt::print("{}", profile_table(figures.profile));
    if (!arguments.json.empty()) write_text_file(arguments.json, about.dump(2) + "\n");
    if (!history.converged) fmt::print(stderr, "livetet: {}\n", history.failure);
    return status;
}

}  // namespace

void add_solve_command(CLI::App& app, ExitStatus& status) {
    CLI::App* command = app.add_subcommand(
        "solve", "Solves a scene, static or dynamic, on one rank or under mpirun");
    command->footer(
        "Other options with one dash go to PETSc: -ksp_view, -log_view, -ksp_monitor ...\nThe keys "
        "of a scene: livetet "
        "scene.");
    auto arguments = std::make_shared<SolveArguments>();
    command->add_option("scene", arguments->scene, "scene file (YAML)")->required();
    command->add_option("--json", arguments->json, "also write the figures to this file");
    command->add_flag("--profile", arguments->profile,
                      "print memory and time of each part, and what was left out (`livetet "
                      "explain` predicts it)");
    command->add_flag("--restart", arguments->restart,
                      "continue from the last checkpoint of an interrupted run "
                      "(output.checkpoint_every), on any number of ranks");
    command->allow_extras();
    command->callback([command, arguments, &status] {
        status.value = solve(*arguments, petsc_arguments(*command));
    });
}

}  // namespace livetet
