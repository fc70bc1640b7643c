#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "apps/commands/commands.hpp"
#include "apps/scene/outputs.hpp"
#include "apps/scene/scene_files.hpp"
#include "apps/simulation/checkpoint.hpp"
#include "apps/simulation/rank_usage.hpp"
#include "apps/simulation/scene_run.hpp"
#include "apps/simulation/solve_profile.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/stopwatch.hpp"
#include "config/yaml.hpp"
#include "io/points_csv.hpp"
#include "io/result_file.hpp"
#include "mechanics/stress.hpp"
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

/// Where displacements at the scene's probe points are read off.
struct Probes {
    std::vector<NamedPoint> points;
    PointSampler sampler;

    Probes(const ProbeOptions& options, const TetMesh& mesh)
        : points(read_points_csv(options.points)), sampler(mesh, positions_of(points)) {
        for (std::size_t i = 0; i < points.size(); ++i)
            if (sampler.distance(i) > 1e-3)
                fmt::print(stderr,
                           "probe {} lies {:.1f} mm outside the mesh; its nearest surface point "
                           "stands for it\n",
                           points[i].name, 1e3 * sampler.distance(i));
    }
};

/// The fields that the scene asks for. Collective.
std::vector<ResultFrame::Field> fields_of(const Scene& scene, DeformableBody& body) {
    const auto& asked = scene.output.fields;
    const auto wanted = [&](const std::string& name) {
        return std::find(asked.begin(), asked.end(), name) != asked.end();
    };
    std::vector<ResultFrame::Field> fields;
    if (wanted("reactions")) {
        const std::vector<Vector3> reactions = body.reactions();
        const double* numbers = reactions.front().data();
        fields.push_back(
            {"reactions", FieldPlace::node, 3, {numbers, numbers + 3 * reactions.size()}});
    }
    if (std::all_of(asked.begin(), asked.end(),
                    [](const std::string& name) { return name == "reactions"; }))
        return fields;
    const std::vector<TetFields> of_tets = body.tet_fields();
    const auto add = [&](const std::string& name, int components, auto&& value_of) {
        if (!wanted(name)) return;
        std::vector<double> values;
        for (const TetFields& f : of_tets) {
            const auto v = value_of(f);
            values.insert(values.end(), v.data(), v.data() + v.size());
        }
        fields.push_back({name, FieldPlace::tet, components, std::move(values)});
    };
    using One = Eigen::Matrix<double, 1, 1>;
    add("stress", 9, [](const TetFields& f) { return f.cauchy_stress_Pa; });
    add("von_mises", 1, [](const TetFields& f) { return One(von_mises(f.cauchy_stress_Pa)); });
    add("strain_energy", 1, [](const TetFields& f) { return One(f.strain_energy_J_per_m3); });
    add("volume_change", 1, [](const TetFields& f) { return One(f.volume_change); });
    return fields;
}

json history_json(const RunHistory& history) {
    json steps = json::array();
    for (const StepRecord& s : history.steps)
        steps.push_back({{"time_s", s.time_s},
                         {"step_s", s.step_s},
                         {"converged", s.report.converged},
                         {"kept", s.kept},
                         {"linearisations", s.report.newton_iterations},
                         {"iterations", s.report.iterations},
                         {"imbalance", s.report.imbalance},
                         {"time_error_mm", 1e3 * s.report.time_error},
                         {"seconds", s.report.seconds()}});
    return steps;
}

/// The first rank's text, on every rank. Collective.
std::string same_on_all(std::string text) {
    auto size = static_cast<std::int64_t>(text.size());
    MPI_Bcast(&size, 1, MPI_INT64_T, 0, PETSC_COMM_WORLD);
    text.resize(static_cast<std::size_t>(size));
    MPI_Bcast(text.data(), static_cast<int>(size), MPI_CHAR, 0, PETSC_COMM_WORLD);
    return text;
}

/// What the first rank alone does; where it fails, all hear of it, for else they would wait for it.
/// Collective.
void on_first_rank(bool first, const std::function<void()>& work) {
    std::exception_ptr own;
    std::string problem;
    try {
        if (first) work();
    } catch (const std::exception& error) {
        own = std::current_exception();
        problem = error.what();
    }
    problem = same_on_all(std::move(problem));
    if (own) std::rethrow_exception(own);  // as what it is: not all is the user's fault
    if (!problem.empty()) throw Error(problem);
}

int solve(const SolveArguments& arguments, const std::vector<std::string>& petsc) {
    // 1. what is asked
    PetscSession session("livetet", petsc);  // first, so that one rank says what is wrong
    const Scene scene = load_scene(arguments.scene);
    refuse_to_overwrite("--json", arguments.json, scene, arguments.scene);
    session.add_options(scene.solver.petsc_options);
    const bool first = session.rank() == 0;
    for (const std::filesystem::path& path :
         {arguments.json, scene.probes ? scene.probes->displacements : std::filesystem::path()})
        if (first && !path.empty())
            (void)PendingFile(path);  // that it can be written, before the hours that it takes
    std::optional<ProgressLine> progress;
    if (first) progress.emplace("solve");

    // 2. mesh, body
    const auto start = std::chrono::steady_clock::now();
    MeshHierarchy hierarchy =
        load_mesh(scene.mesh, progress ? progress->callback() : ProgressCallback{});
    const double mesh_s = seconds_since(start);
    SceneBody scene_body = make_body(PETSC_COMM_WORLD, scene, std::move(hierarchy));
    SceneConstraints constraints(scene, scene_body.mesh());
    check_held(scene, scene_body.mesh(), constraints);
    const double setup_s = seconds_since(start) - mesh_s;
    std::optional<Probes> probes;
    if (scene.probes) probes.emplace(*scene.probes, scene_body.mesh());

    // 3. steps, kept as the scene says
    const bool dynamic = scene.time.scheme != TimeScheme::static_equilibrium;
    const bool keeps_going = dynamic && (scene.output.checkpoint_every > 0 || arguments.restart);
    if (keeps_going && !scene.output.has_file())
        fail("output.file = none: checkpoints go into it in the end, expected a file");
    if (arguments.restart && !dynamic)
        fail("--restart: the scene is static, expected a dynamic one with checkpoints");
    Scene of_results = scene;
    of_results.output.checkpoint_every = 0;  // may be another when the run goes on
    std::string run = to_yaml(of_results);
    if (keeps_going) {
        std::string stamps;
        on_first_rank(first, [&] { stamps = stamps_of(mesh_files(scene)); });
        run += same_on_all(std::move(stamps));
    }
    const CheckpointStore store(scene.output.file, run);
    RunHooks hooks{.progress = progress ? progress->callback() : ProgressCallback{}};
    if (arguments.restart) {
        BodySnapshot state;
        std::tie(hooks.start, state) = store.read();
        scene_body.body->set_state(state);
    } else if (keeps_going && first) {
        store.begin();
    }
    std::optional<ResultWriter> writer;
    if (scene.output.has_file())
        writer.emplace(scene.output.file, scene_body.mesh(), to_yaml(scene), Precision::full,
                       PETSC_COMM_WORLD);
    ResultFrame last;
    std::size_t frames = hooks.start.frames;
    double output_s = 0;
    hooks.keep = [&](std::size_t number, double time) {
        const auto began = std::chrono::steady_clock::now();
        last = {};  // a large mesh's numbers stand once, not twice
        last = {time, scene_body.body->displacement(), {}};
        frames = number + 1;
        if (!writer) return;
        last.fields = fields_of(scene, *scene_body.body);
        if (!keeps_going)
            append_frame(*writer, last);
        else
            on_first_rank(first, [&] { store.keep(number, last); });
        last.fields.clear();
        output_s += seconds_since(began);
    };
    if (scene.output.checkpoint_every > 0)
        hooks.checkpoint = [&](const RunPlace& place) {
            const BodySnapshot state = scene_body.body->gather_state();
            on_first_rank(first, [&] { store.write(place, state); });
        };
    const RunHistory history = run_scene(scene, scene_body, constraints, hooks);
    progress.reset();
    if (last.displacement.empty()) last.displacement = scene_body.body->displacement();
    const auto forces = constraints.forces(scene_body.body->reactions(), last.displacement);
    const std::size_t inverted = scene_body.body->inverted_tets();
    const RankUsage usage = usage_of_ranks(PETSC_COMM_WORLD);
    std::vector<ProfileRow> profile;
    if (arguments.profile)
        profile = solve_profile(PETSC_COMM_WORLD, scene, scene_body, mesh_s,
                                {0, output_s, static_cast<long>(frames)});

    // 4. results
    StepReport sum;
    for (const StepRecord& step : history.steps) {
        const StepReport& r = step.report;
        sum.iterations += r.iterations;
        sum.newton_iterations += r.newton_iterations;
        sum.forces_s += r.forces_s + r.finish_s;
        sum.operator_s += r.operator_s;
        sum.preconditioner_s += r.preconditioner_s;
        sum.solve_s += r.solve_s;
    }
    json told{{"tets", scene_body.mesh().tets.size()},
              {"nodes", scene_body.mesh().nodes.size()},
              {"levels", scene_body.hierarchy.levels.size()},
              {"ranks", session.ranks()},
              {"version", LIVETET_VERSION},
              {"largest_displacement_mm", 1e3 * largest_norm(last.displacement)},
              {"converged", history.converged},
              {"failure", history.failure},
              {"inverted_tets", inverted},
              {"share", history.share},
              {"is_static", !dynamic},
              {"restarted_at_s", hooks.start.time_s},
              {"reactions_N", json::object()},
              {"iterations", sum.iterations},
              {"linearisations", sum.newton_iterations},
              {"mesh_s", mesh_s},
              {"partition_s", scene_body.partition_s},
              {"setup_s", setup_s},
              {"solve_s", sum.seconds()},
              {"forces_s", sum.forces_s},
              {"assembly_s", sum.operator_s},
              {"preconditioner_s", sum.preconditioner_s},
              {"linear_s", sum.solve_s},
              {"solver", scene_body.body->linear_solver().name()},
              {"peak_bytes", usage.peak_bytes},
              {"peak_bytes_most", usage.peak_bytes_most},
              {"messages", usage.messages},
              {"message_bytes", usage.message_bytes},
              {"reductions", usage.reductions},
              {"profile", json_of(profile)},
              {"steps", history_json(history)}};
    for (const auto& [key, force] : forces)
        told["reactions_N"][key] = {force.x(), force.y(), force.z()};
    const auto closing = std::chrono::steady_clock::now();
    MPI_Barrier(PETSC_COMM_WORLD);  // the first rank's frames are there
    if (keeps_going) on_first_rank(first, [&] { store.check_frames(frames); });
    if (keeps_going)
        for (std::size_t k = 0; k < frames; ++k) append_frame(*writer, store.frame(k));
    const bool has_state = frames > 0;  // else what was there before stays
    if (writer && has_state) {
        writer->write_text("solve", same_on_all(told.dump()));
        writer->close();
    }
    session.tell_unused_options();
    if (!first) return history.converged ? 0 : 3;
    if (keeps_going) store.remove();
    if (probes && has_state)
        write_displacements_csv(scene.probes->displacements, probes->points,
                                probes->sampler.sample(last.displacement));
    output_s += seconds_since(closing);
    told["output_s"] = output_s;
    fmt::print("mesh             {} tets, {} nodes, {} level(s)\n", scene_body.mesh().tets.size(),
               scene_body.mesh().nodes.size(), scene_body.hierarchy.levels.size());
    fmt::print("ranks            {}\n", session.ranks());
    fmt::print("displacement     {:.4f} mm at most\n", 1e3 * largest_norm(last.displacement));
    fmt::print("solver           {}\n", scene_body.body->linear_solver().name());
    fmt::print("steps            {}, {} linearisations, {} iterations, {}\n", history.steps.size(),
               sum.newton_iterations, sum.iterations,
               history.converged ? "converged" : "NOT converged");
    fmt::print("imbalance        {:.2e} (last step)\n", history.steps.back().report.imbalance);
    if (inverted > 0)
        fmt::print(
            "inside out       {} tets: stresses there mean nothing; a finer mesh or a gentler load "
            "may help\n",
            inverted);
    for (const auto& [key, force] : forces)
        fmt::print("{:<16} ({:.4g}, {:.4g}, {:.4g}) N on the body\n", key, force.x(), force.y(),
                   force.z());
    fmt::print("seconds          mesh {:.2f}, set-up {:.2f}, solve {:.2f}\n", mesh_s, setup_s,
               sum.seconds());
    const std::string result =
        scene.output.has_file() ? scene.output.file.string() : "no result (output.file: none)";
    fmt::print("written          {}\n", !has_state ? "nothing: no state was reached"
                                        : probes
                                            ? result + ", " + scene.probes->displacements.string()
                                            : result);
    if (arguments.profile) fmt::print("{}", profile_table(profile));
    if (!arguments.json.empty()) write_text_file(arguments.json, told.dump(2) + "\n");
    if (!history.converged) fmt::print(stderr, "livetet: {}\n", history.failure);
    return history.converged ? 0 : 3;
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
    command->add_option("--json", arguments->json, "write the figures to this file too");
    command->add_flag(
        "--profile", arguments->profile,
        "what each part took, and what was left out (`livetet explain` says so before)");
    command->add_flag("--restart", arguments->restart,
                      "go on from the last checkpoint of a run that was ended "
                      "(output.checkpoint_every), on any number of ranks");
    command->allow_extras();
    command->callback([command, arguments, &status] {
        status.value = solve(*arguments, petsc_arguments(*command));
    });
}

}  // namespace livetet
