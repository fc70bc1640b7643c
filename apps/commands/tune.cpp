#include <fmt/format.h>

#include <algorithm>

#include "apps/bench/live_choices.hpp"
#include "apps/bench/workprecision_bench.hpp"
#include "apps/commands/commands.hpp"
#include "apps/scene/body_factory.hpp"
#include "apps/scene/live_element.hpp"
#include "apps/scene/outputs.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/work_folder.hpp"
#include "config/yaml.hpp"
#include "io/hierarchy_file.hpp"
#include "io/text.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

struct TuneArguments {
    std::filesystem::path scene, output;
    std::string error, budget, measure = "largest";
    int repeats = 2;
};

/// "0.5mm" in metres.
double metres_of(const std::string& text) {
    std::size_t used = 0;
    double value = 0;
    try {
        value = std::stod(text, &used);
    } catch (const std::exception&) {
        used = 0;
    }
    const std::string unit = used ? std::string(trim(text.substr(used))) : "";
    if (!(value > 0) || (unit != "mm" && unit != "m" && unit != "um"))
        fail("--error {}: expected a length above 0 with its unit, as 0.5mm", text);
    return value * (unit == "mm" ? 1e-3 : unit == "um" ? 1e-6 : 1);
}

/// What is asked for, checked.
struct TuneRequest {
    std::filesystem::path scene, output;
    ErrorMeasure measure;
    double error_m;
    std::optional<double> budget_s;
    int repeats;
    std::string error, budget;  ///< as given

    std::string options() const {
        return fmt::format("--error {}{}", error, budget.empty() ? "" : " --budget " + budget);
    }
};

/// Writes a scene with a mesh of its own beside it.
std::filesystem::path write_tuned(const TuneRequest& r, Scene tuned, const MeshHierarchy& levels,
                                  const std::string& why) {
    std::filesystem::path mesh = r.output;
    mesh.replace_extension("h5");
    write_hierarchy(mesh, levels);
    tuned.mesh = {};
    tuned.mesh.file = std::filesystem::absolute(mesh);
    write_text_file(r.output,
                    fmt::format("# {} by `livetet tune {}`: {}\n{}\n", r.scene.filename().string(),
                                r.options(), why, to_yaml(tuned)));
    return mesh;
}

int tune_solve(const TuneRequest& r, const Scene& scene) {
    const WorkFolder folder;
    const WorkPrecision w = measure_choices(scene, folder.path(), {.repeats = r.repeats});
    if (w.interrupted) throw *w.interrupted;
    const ChoiceResult* best = w.cheapest(r.measure, r.error_m, r.budget_s);
    if (!best) {
        const ChoiceResult* nearest = w.most_accurate(r.measure, r.budget_s.value_or(1e30));
        if (!nearest) fail("{}: no choice takes {} a step at most", r.scene.string(), r.budget);
        fmt::print(stderr,
                   "livetet: no choice has an error of {} at most{}; the nearest is {} ({}): "
                   "{:.3f} mm, {:.2f} ms a step\n",
                   r.error, r.budget_s ? fmt::format(" in {} a step", r.budget) : "",
                   nearest->choice.name, nearest->choice.varied, 1e3 * nearest->error_m(r.measure),
                   1e3 * nearest->step_s);
        return 3;
    }

    // The chosen settings; all others from the scene.
    Scene tuned = scene;
    const Scene& chosen = best->choice.scene;
    tuned.elements = chosen.elements;
    tuned.strain = chosen.strain;
    tuned.formulation = chosen.formulation;
    tuned.time = chosen.time;
    tuned.solver = chosen.solver;
    const std::filesystem::path mesh =
        write_tuned(r, tuned, read_hierarchy(chosen.mesh.file),
                    fmt::format("{} ({}), {:.3f} mm at most from ten-node tets on the finest\n"
                                "# mesh, {:.3f} s in all, {:.2f} ms a step, {:.0f} MB.",
                                best->choice.name, best->choice.varied, 1e3 * best->error.largest_m,
                                best->total_s, 1e3 * best->step_s, best->peak_bytes / 1e6));
    fmt::print(
        "chosen           {} ({})\nerror            {:.3f} mm at most, {:.3f} mm in the mean\ntime "
        "            {:.3f} s in all, {:.2f} ms a step\n"
        "memory           {:.0f} MB\nwritten          {}, {}\n",
        best->choice.name, best->choice.varied, 1e3 * best->error.largest_m, 1e3 * best->error.l2_m,
        best->total_s, 1e3 * best->step_s, best->peak_bytes / 1e6, r.output.string(),
        mesh.string());
    return 0;
}

void print_live(const LiveChoices& choices) {
    fmt::print("{:<14} {:>8} {:>8} | {:>7} {:>7} {:>7} {:>7} | {:>8} {:>8}\n", "choice", "tets",
               "nodes", "median", "p99", "p99 *", "cpu", "largest", "mean");
    fmt::print("{:<14} {:>8} {:>8} | {:>7} {:>7} {:>7} {:>7} | {:>8} {:>8}\n", "", "", "", "ms",
               "ms", "ms", "ms", "mm", "mm");
    for (const LiveCandidate& c : choices.measured)
        fmt::print("{:<14} {:>8} {:>8} | {:>7.2f} {:>7.2f} {:>7} {:>7.2f} | {:>8.3f} {:>8.3f}\n",
                   c.name(), c.tets, c.nodes, 1e3 * c.times.all.median, 1e3 * c.times.all.p99,
                   p99_with_cores_text(c.times), 1e3 * c.times.cpu_s, 1e3 * c.largest_m,
                   1e3 * c.l2_m);
    const Vector3 at = 1e3 * choices.press.place;
    fmt::print(
        "* of the frames that had their cores: no involuntary switch, no steal\n"
        "Pressed by {:.1f} mm at ({:.1f}, {:.1f}, {:.1f}) mm once a second, sixty frames a second; "
        "errors against\nten-node tets on the finest level, in {:.0f} s\n",
        1e3 * choices.press.depth, at.x(), at.y(), at.z(), choices.reference_s);
    for (const std::string& text : choices.left_out) fmt::print("left out         {}\n", text);
    fmt::print("\n");
}

/// The element and level of a `track` scene.
int tune_live(const TuneRequest& r, const Scene& scene) {
    const PetscSession session("livetet", {});
    if (session.ranks() > 1) fail("tune runs on one rank, found {}", session.ranks());
    ProgressLine progress("tune");
    const MeshHierarchy hierarchy = load_mesh(scene, progress.callback());
    refuse_hexahedra(hierarchy, "tune");
    const std::optional<double> budget_s =
        r.budget_s ? r.budget_s : seconds_of(scene.track->budget);
    const LiveChoices choices =
        measure_live_choices(scene, hierarchy, 120 * r.repeats, budget_s, progress);
    if (choices.measured.empty())
        fail("{}: the live solver takes the scene on no level: {}", r.scene.string(),
             choices.left_out.empty() ? "it has none" : choices.left_out.front());
    print_live(choices);
    fmt::print("{}\n",
               describe_live_element(scene, hierarchy.levels.front().tets.size(), budget_s));
    const LiveCandidate* best = choices.cheapest(r.measure, r.error_m, budget_s);
    if (!best) {
        const std::string in_time =
            budget_s ? fmt::format(" in {:g} ms a frame", 1e3 * *budget_s) : "";
        const LiveCandidate* nearest = choices.most_accurate(r.measure, budget_s);
        if (!nearest) fail("{}: no choice makes 99 % of its frames{}", r.scene.string(), in_time);
        fmt::print(stderr,
                   "livetet: no choice has an error of {} at most{}; the nearest is {}: {:.3f} mm, "
                   "{:.2f} ms a frame\n",
                   r.error, in_time, nearest->name(), 1e3 * nearest->error_m(r.measure),
                   1e3 * nearest->times.all.p99);
        return 3;
    }
    Scene tuned = scene;
    tuned.elements = best->elements;
    tuned.solver.kind = SolverKind::automatic;  // the live solver
    const std::filesystem::path mesh =
        write_tuned(r, tuned, levels_from(hierarchy, best->level),
                    fmt::format("{}, {:.3f} mm at most from ten-node tets on the\n"
                                "# finest mesh, 99 % of the frames in {:.2f} ms.",
                                best->name(), 1e3 * best->largest_m, 1e3 * best->times.all.p99));
    fmt::print(
        "chosen           {}: {} tets\nerror            {:.3f} mm at most, {:.3f} mm in the mean\n"
        "time             {:.2f} ms a frame, 99 % in {:.2f} ms\nwritten          {}, {}\n",
        best->name(), best->tets, 1e3 * best->largest_m, 1e3 * best->l2_m,
        1e3 * best->times.all.median, 1e3 * best->times.all.p99, r.output.string(), mesh.string());
    return 0;
}

int tune(const TuneArguments& a) {
    TuneRequest r{a.scene,
                  a.output,
                  a.measure == "largest" ? ErrorMeasure::largest : ErrorMeasure::l2,
                  metres_of(a.error),
                  a.budget.empty() ? std::nullopt : seconds_of(a.budget),
                  a.repeats,
                  a.error,
                  a.budget};
    if (!a.budget.empty() && !r.budget_s)
        fail("--budget {}: expected a time with its unit, as 12ms", a.budget);
    if (r.output.empty())
        r.output = a.scene.parent_path() / (a.scene.stem().string() + ".tuned.yaml");
    refuse_to_overwrite("--output", r.output, {a.scene});
    const Scene scene = load_scene(std::filesystem::absolute(a.scene));
    if (!scene.cuts.empty())
        fail("{}: found cuts, expected a scene without them: tune writes a mesh of its own",
             a.scene.string());
    return scene.track ? tune_live(r, scene) : tune_solve(r, scene);
}

}  // namespace

void add_tune_command(CLI::App& app, ExitStatus& status) {
    CLI::App* command =
        app.add_subcommand("tune",
                           "Finds the cheapest settings that solve a scene within "
                           "an error, and writes them to a scene file. With a track "
                           "section: the tets and the level for its frames");
    auto arguments = std::make_shared<TuneArguments>();
    command->add_option("scene", arguments->scene, "scene file (YAML)")->required();
    command->add_option("--error", arguments->error, "maximum error of displacements: 0.5mm")
        ->required();
    command
        ->add_option("--measure", arguments->measure,
                     "measure of the error: largest, at the worst node and time, or l2, the mean "
                     "over the volume")
        ->capture_default_str()
        ->check(CLI::IsMember({"largest", "l2"}));
    command->add_option("--budget", arguments->budget,
                        "maximum time of a step, or of a frame: 12ms; default for frames: "
                        "track.budget");
    command->add_option("-o,--output", arguments->output,
                        "output scene file; default: SCENE.tuned.yaml, with its mesh beside it");
    command
        ->add_option(
            "--repeats", arguments->repeats,
            "rounds whose median time is used; choices slower than 5 s run once. Frames: 120 of "
            "each round")
        ->capture_default_str()
        ->check(CLI::Range(1, 100));
    command->callback([arguments, &status] { status.value = tune(*arguments); });
}

}  // namespace livetet
