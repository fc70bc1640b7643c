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

/// Samples displacements at the scene's probe points.
struct Probes {
    std::vector<NamedPoint> points;
    PointSampler sampler;

    Probes(const ProbeOptions& options, const TetMesh& mesh)
        : points(read_points_csv(options.points)), sampler(mesh, positions_of(points)) {
        for (std::size_t i = 0; i < points.size(); ++i)
            if (sampler.distance(i) > 1e-3)
                fmt::print(
                    stderr,
                    "probe {} is {:.1f} mm outside the mesh; its nearest surface point is used\n",
                    points[i].name, 1e3 * sampler.distance(i));
    }
};

/// The fields that the scene requests. Collective.
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

/// Returns the text of rank 0 on every rank. Collective.
std::string same_on_all(std::string text) {
    auto size = static_cast<std::int64_t>(text.size());
    MPI_Bcast(&size, 1, MPI_INT64_T, 0, PETSC_COMM_WORLD);
    text.resize(static_cast<std::size_t>(size));
    MPI_Bcast(text.data(), static_cast<int>(size), MPI_CHAR, 0, PETSC_COMM_WORLD);
    return text;
}

/// Runs `work` on the first rank. If it throws, all ranks throw: the others would wait for ever.
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
    if (own) std::rethrow_exception(own);  // keeps its type: not every error is the user's
    if (!problem.empty()) throw Error(problem);
}

/// Checks what can be checked before anything runs. Collective.
void check_files(const SolveArguments& arguments, const Scene& scene, bool first) {
    refuse_to_overwrite("--json", arguments.json, scene, arguments.scene);
    for (const std::filesystem::path& path :
         {arguments.json, scene.probes ? scene.probes->displacements : std::filesystem::path()})
        if (first && !path.empty()) (void)PendingFile(path);  // throws if it cannot be written
}

bool is_dynamic(const Scene& scene) { return scene.time.scheme != TimeScheme::static_equilibrium; }

/// Whether the run writes checkpoints. Throws Error if it should but cannot.
bool keeps_checkpoints(const SolveArguments& arguments, const Scene& scene) {
    const bool keeps =
        is_dynamic(scene) && (scene.output.checkpoint_every > 0 || arguments.restart);
    if (keeps && !scene.output.has_file())
        fail("output.file = none: checkpoints end up in this file, expected a name");
    if (arguments.restart && !is_dynamic(scene))
        fail("--restart: the scene is static, expected a dynamic one with checkpoints");
    return keeps;
}

/// What a restarted run must have in common with its first part. Collective.
std::string run_identity(const Scene& scene, bool keeps, bool first) {
    Scene of_results = scene;
    of_results.output.checkpoint_every = 0;  // may change at a restart
    std::string identity = to_yaml(of_results);
    if (keeps) {
        std::string stamps;
        on_first_rank(first, [&] { stamps = stamps_of(mesh_files(scene)); });
        identity += same_on_all(std::move(stamps));
    }
    return identity;
}

/// Keeps the states of a run: in the result as they come or, where the run may be restarted, as
/// files of the first rank that `close` puts into the result. All functions are collective.
class StateKeeper {
  public:
    StateKeeper(const SolveArguments& arguments, const Scene& scene, SceneBody& body, bool first)
        : scene_(scene),
          body_(*body.body),
          first_(first),
          keeps_checkpoints_(keeps_checkpoints(arguments, scene)),
          store_(scene.output.file, run_identity(scene, keeps_checkpoints_, first)) {
        if (arguments.restart) {
            BodySnapshot state;
            std::tie(start_, state) = store_.read();
            body_.set_state(state);
        } else if (keeps_checkpoints_ && first) {
            store_.begin();
        }
        frames_ = start_.frames;
        if (scene.output.has_file())
            writer_.emplace(scene.output.file, body.mesh(), to_yaml(scene), Precision::full,
                            PETSC_COMM_WORLD);
    }

    RunHooks hooks(ProgressCallback progress) {
        RunHooks hooks{.progress = std::move(progress), .start = start_};
        hooks.keep = [this](std::size_t number, double time) { keep(number, time); };
        if (scene_.output.checkpoint_every > 0)
            hooks.checkpoint = [this](const RunPlace& place) {
                const BodySnapshot state = body_.gather_state();
                on_first_rank(first_, [&] { store_.write(place, state); });
            };
        return hooks;
    }

    /// Completes the result; `about` is the run's description. Leaves an older result alone where
    /// no state was reached.
    void close(const json& about) {
        const auto began = std::chrono::steady_clock::now();
        MPI_Barrier(PETSC_COMM_WORLD);  // the first rank has written its frames
        if (keeps_checkpoints_) {
            on_first_rank(first_, [&] { store_.check_frames(frames_); });
            for (std::size_t k = 0; k < frames_; ++k) append_frame(*writer_, store_.frame(k));
        }
        if (writer_ && frames_ > 0) {
            writer_->write_text("solve", same_on_all(about.dump()));
            writer_->close();
        }
        output_s_ += seconds_since(began);
    }

    /// By the first rank, after `close`: removes what a restart would need.
    void remove_checkpoints() const {
        if (keeps_checkpoints_) store_.remove();
    }

    std::size_t frames() const { return frames_; }
    double start_s() const { return start_.time_s; }
    double output_s() const { return output_s_; }
    /// Of the last state that was kept; the body's own where none was.
    const std::vector<Vector3>& displacement() {
        if (last_.displacement.empty()) last_.displacement = body_.displacement();
        return last_.displacement;
    }

  private:
    void keep(std::size_t number, double time) {
        const auto began = std::chrono::steady_clock::now();
        last_ = {};  // frees the last displacement before the next is gathered
        last_ = {time, body_.displacement(), {}};
        frames_ = number + 1;
        if (!writer_) return;
        last_.fields = fields_of(scene_, body_);
        if (!keeps_checkpoints_)
            append_frame(*writer_, last_);
        else
            on_first_rank(first_, [&] { store_.keep(number, last_); });
        last_.fields.clear();
        output_s_ += seconds_since(began);
    }

    const Scene& scene_;
    DeformableBody& body_;
    bool first_, keeps_checkpoints_;
    CheckpointStore store_;
    RunPlace start_;
    std::optional<ResultWriter> writer_;
    ResultFrame last_;
    std::size_t frames_ = 0;
    double output_s_ = 0;
};

/// Figures of a run that are not in its history.
struct SolveFigures {
    int ranks = 1;
    double mesh_s = 0, setup_s = 0;
    StepReport sum;  ///< counts and times of all steps
    double largest_displacement_m = 0;
    std::size_t inverted_tets = 0;
    std::vector<std::pair<std::string, Vector3>> forces;  ///< N on the body, by constraint
    std::vector<ProfileRow> profile;                      ///< of --profile
};

StepReport sum_of(const RunHistory& history) {
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
    return sum;
}

/// The run's description, for the result and --json. Collective.
json describe(const Scene& scene, const SceneBody& body, const RunHistory& history,
              const SolveFigures& figures, double start_s) {
    const RankUsage usage = usage_of_ranks(PETSC_COMM_WORLD);
    const StepReport& sum = figures.sum;
    json about{{"tets", body.mesh().tets.size()},
               {"nodes", body.mesh().nodes.size()},
               {"levels", body.hierarchy.levels.size()},
               {"ranks", figures.ranks},
               {"version", LIVETET_VERSION},
               {"largest_displacement_mm", 1e3 * figures.largest_displacement_m},
               {"converged", history.converged},
               {"failure", history.failure},
               {"inverted_tets", figures.inverted_tets},
               {"share", history.share},
               {"is_static", !is_dynamic(scene)},
               {"restarted_at_s", start_s},
               {"reactions_N", json::object()},
               {"iterations", sum.iterations},
               {"linearisations", sum.newton_iterations},
               {"mesh_s", figures.mesh_s},
               {"partition_s", body.partition_s},
               {"setup_s", figures.setup_s},
               {"solve_s", sum.seconds()},
               {"forces_s", sum.forces_s},
               {"assembly_s", sum.operator_s},
               {"preconditioner_s", sum.preconditioner_s},
               {"linear_s", sum.solve_s},
               {"solver", body.body->linear_solver().name()},
               {"peak_bytes", usage.peak_bytes},
               {"peak_bytes_most", usage.max_peak_bytes},
               {"messages", usage.messages},
               {"message_bytes", usage.message_bytes},
               {"reductions", usage.reductions},
               {"profile", json_of(figures.profile)},
               {"steps", history_json(history)}};
    for (const auto& [key, force] : figures.forces)
        about["reactions_N"][key] = {force.x(), force.y(), force.z()};
    return about;
}

void print_figures(const SceneBody& body, const RunHistory& history, const SolveFigures& figures) {
    fmt::print("mesh             {} tets, {} nodes, {} level(s)\n", body.mesh().tets.size(),
               body.mesh().nodes.size(), body.hierarchy.levels.size());
    fmt::print("ranks            {}\n", figures.ranks);
    fmt::print("displacement     {:.4f} mm at most\n", 1e3 * figures.largest_displacement_m);
    fmt::print("solver           {}\n", body.body->linear_solver().name());
    fmt::print("steps            {}, {} Newton iterations, {} Krylov iterations, {}\n",
               history.steps.size(), figures.sum.newton_iterations, figures.sum.iterations,
               history.converged ? "converged" : "NOT converged");
    fmt::print("imbalance        {:.2e} (last step)\n", history.steps.back().report.imbalance);
    if (figures.inverted_tets > 0)
        fmt::print(
            "inverted         {} tets: their stresses are meaningless; use a finer mesh or a "
            "smaller load\n",
            figures.inverted_tets);
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
    const auto callback = [&] { return progress ? progress->callback() : ProgressCallback{}; };

    // 2. mesh, body
    SolveFigures figures;
    figures.ranks = session.ranks();
    const auto start = std::chrono::steady_clock::now();
    MeshHierarchy hierarchy = load_mesh(scene.mesh, callback());
    figures.mesh_s = seconds_since(start);
    SceneBody body = make_body(PETSC_COMM_WORLD, scene, std::move(hierarchy), Use::solve);
    SceneConstraints constraints(scene, body.mesh());
    check_no_free_motion(scene, body.mesh(), constraints);
    figures.setup_s = seconds_since(start) - figures.mesh_s;
    std::optional<Probes> probes;
    if (scene.probes) probes.emplace(*scene.probes, body.mesh());

    // 3. steps
    StateKeeper states(arguments, scene, body, first);
    const RunHistory history = run_scene(scene, body, constraints, states.hooks(callback()));
    progress.reset();
    const std::vector<Vector3>& displacement = states.displacement();
    figures.forces = constraints.forces(body.body->reactions(), displacement);
    figures.inverted_tets = body.body->inverted_tets();
    figures.largest_displacement_m = largest_norm(displacement);
    figures.sum = sum_of(history);
    if (arguments.profile)
        figures.profile = solve_profile(PETSC_COMM_WORLD, scene, body, figures.mesh_s,
                                        {0, states.output_s(), static_cast<long>(states.frames())});

    // 4. results
    json about = describe(scene, body, history, figures, states.start_s());
    states.close(about);
    session.tell_unused_options();
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
