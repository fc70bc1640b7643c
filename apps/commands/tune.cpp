#include <fmt/format.h>

#include <algorithm>

#include "apps/bench/workprecision_bench.hpp"
#include "apps/commands/commands.hpp"
#include "apps/scene/body_factory.hpp"
#include "apps/scene/outputs.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/work_folder.hpp"
#include "config/yaml.hpp"
#include "io/hierarchy_file.hpp"
#include "io/text.hpp"

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

int tune(const TuneArguments& a) {
    const double error_m = metres_of(a.error);
    const ErrorMeasure measure = a.measure == "largest" ? ErrorMeasure::largest : ErrorMeasure::l2;
    const std::optional<double> budget = a.budget.empty() ? std::nullopt : seconds_of(a.budget);
    if (!a.budget.empty() && !budget)
        fail("--budget {}: expected a time with its unit, as 12ms", a.budget);
    std::filesystem::path output = a.output;
    if (output.empty()) output = a.scene.parent_path() / (a.scene.stem().string() + ".tuned.yaml");
    refuse_to_overwrite("--output", output, {a.scene});
    const Scene scene = load_scene(std::filesystem::absolute(a.scene));
    const WorkFolder folder;
    const WorkPrecision w = measure_choices(scene, folder.path(), {.repeats = a.repeats});
    if (w.interrupted) throw *w.interrupted;
    const ChoiceResult* best = w.cheapest(measure, error_m, budget);
    if (!best) {
        const ChoiceResult* nearest = w.most_accurate(measure, budget.value_or(1e30));
        if (!nearest) fail("{}: no choice takes {} a step at most", a.scene.string(), a.budget);
        fmt::print(stderr,
                   "livetet: no choice has an error of {} at most{}; the nearest is {} ({}): "
                   "{:.3f} mm, {:.2f} ms a step\n",
                   a.error, budget ? fmt::format(" in {} a step", a.budget) : "",
                   nearest->choice.name, nearest->choice.varied, 1e3 * nearest->error_m(measure),
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
    std::filesystem::path mesh = output;
    mesh.replace_extension("h5");
    const MeshHierarchy levels = read_hierarchy(chosen.mesh.file);
    write_hierarchy(mesh, levels);
    tuned.mesh = {};
    tuned.mesh.file = std::filesystem::absolute(mesh);
    write_text_file(
        output,
        fmt::format("# {} by `livetet tune --error {}{}`: {} ({}), {:.3f} mm at most from ten-node "
                    "tets on the finest\n"
                    "# mesh, {:.3f} s in all, {:.2f} ms a step, {:.0f} MB.\n{}\n",
                    a.scene.filename().string(), a.error, budget ? " --budget " + a.budget : "",
                    best->choice.name, best->choice.varied, 1e3 * best->error.largest_m,
                    best->total_s, 1e3 * best->step_s, best->peak_bytes / 1e6, to_yaml(tuned)));
    fmt::print(
        "chosen           {} ({})\nerror            {:.3f} mm at most, {:.3f} mm in the mean\ntime "
        "            {:.3f} s in all, {:.2f} ms a step\n"
        "memory           {:.0f} MB\nwritten          {}, {}\n",
        best->choice.name, best->choice.varied, 1e3 * best->error.largest_m, 1e3 * best->error.l2_m,
        best->total_s, 1e3 * best->step_s, best->peak_bytes / 1e6, output.string(), mesh.string());
    return 0;
}

}  // namespace

void add_tune_command(CLI::App& app, ExitStatus& status) {
    CLI::App* command = app.add_subcommand("tune",
                                           "Finds the cheapest settings that solve a scene within "
                                           "an error, and writes them to a scene file");
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
    command->add_option("--budget", arguments->budget, "maximum time of a step: 12ms");
    command->add_option("-o,--output", arguments->output,
                        "output scene file; default: SCENE.tuned.yaml, with its mesh beside it");
    command
        ->add_option("--repeats", arguments->repeats,
                     "rounds whose median time is used; choices slower than 5 s run once")
        ->capture_default_str()
        ->check(CLI::Range(1, 100));
    command->callback([arguments, &status] { status.value = tune(*arguments); });
}

}  // namespace livetet
