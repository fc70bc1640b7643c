#include <fmt/format.h>

#include <optional>

#include "apps/commands/commands.hpp"
#include "apps/commands/image_program.hpp"
#include "apps/scene/outputs.hpp"
#include "apps/simulation/solve_scene.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "mesh/hex_grid.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

struct SolveArguments {
    std::filesystem::path scene, json;
    bool restart = false, profile = false;
};

/// Checks what can be checked before anything runs.
void check_files(const SolveArguments& arguments, const Scene& scene, bool first) {
    refuse_to_overwrite("--json", arguments.json, scene, arguments.scene);
    if (first && !arguments.json.empty()) expect_writable(arguments.json);
}

void print_figures(const SceneBody& body, const RunHistory& history, const RunFigures& figures) {
    const bool has_hexahedra = body.mesh().has_hexahedra();
    const std::size_t levels =
        has_hexahedra ? static_cast<std::size_t>(body.body->linear_solver().level_count())
                      : body.hierarchy.levels.size();
    fmt::print(
        "mesh             {}, {} nodes, {}\n",
        has_hexahedra ? elements_text(body.mesh()) : fmt::format("{} tets", body.tet_count()),
        body.node_count(), counted(levels, "level"));
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
            counted(figures.inverted_tets, has_hexahedra ? "hexahedron" : "tet"));
    for (const std::string& sentence : figures.beyond_model)
        fmt::print("warning          {}\n", sentence);
    for (const auto& [key, force] : figures.forces)
        fmt::print("{:<16} ({:.4g}, {:.4g}, {:.4g}) N on the body\n", key, force.x(), force.y(),
                   force.z());
    fmt::print("seconds          mesh {:.2f}, set-up {:.2f}, solve {:.2f}\n", figures.mesh_s,
               figures.setup_s, figures.sum.seconds());
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

    // 2. mesh, body, steps, result
    const SolvedScene solved = solve_scene(
        scene, {.start = arguments.restart ? RunStart::from_checkpoint : RunStart::anew,
                .profile = arguments.profile,
                .progress = progress ? progress->callback() : ProgressCallback{},
                .iterated = [&] { session.tell_unused_options(PetscSession::Moment::set_up); }});
    progress.reset();
    session.tell_unused_options(PetscSession::Moment::end);
    const RunHistory& history = solved.history;
    const int status = history.converged ? 0 : 3;
    if (!first) return status;

    // 3. figures
    print_figures(solved.body, history, solved.figures);
    fmt::print("written          {}\n", written_text(scene, solved.frames > 0));
    if (arguments.profile) fmt::print("{}", profile_table(solved.figures.profile));
    if (!arguments.json.empty()) write_text_file(arguments.json, solved.description + "\n");
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
        run_image_program_for(arguments->scene);
        status.value = solve(*arguments, petsc_arguments(*command));
    });
}

}  // namespace livetet
