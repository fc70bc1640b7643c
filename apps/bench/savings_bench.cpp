#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/bench/benchmarks.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/solve_run.hpp"
#include "apps/scene/body_factory.hpp"
#include "base/distribution.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"
#include "base/work_folder.hpp"
#include "config/yaml.hpp"
#include "io/hierarchy_file.hpp"

namespace livetet {

namespace {

struct SavingsArguments {
    std::filesystem::path scene, json, folder;
    int repeats = 5;
};

struct Variant {
    std::string name;
    Scene scene;
    std::vector<double> setup_s{}, steps_s{}, output_s{};
    double peak_bytes = 0;
};

/// The scene, and variants with a part forced on that it leaves out.
std::vector<Variant> variants_of(const Scene& scene) {
    std::vector<Variant> all{{"as it is", scene}};
    Scene everything = scene;
    const auto force = [&](const std::string& name, bool left_out, auto&& set) {
        if (!left_out) return;
        Scene one = scene;
        set(one);
        set(everything);
        all.push_back({"with " + name, one});
    };
    force("rotations", is_small_strain(scene.materials, scene.strain), [](Scene& s) {
        s.strain = "corotated";
        for (Material& m : s.materials) m.model = {};
    });
    const bool could_be_mixed = std::all_of(scene.materials.begin(), scene.materials.end(),
                                            [](const Material& m) { return m.poisson > 0; });
    force("pressures",
          could_be_mixed && resolved_formulation(elastic_model(scene)) == Formulation::displacement,
          [](Scene& s) { s.formulation = Formulation::mixed; });
    force("mass, velocities, damping", !scene.time.is_dynamic(), [&](Scene& s) {
        // As many steps, each long enough for the body to come to rest.
        s.time.scheme = TimeScheme::implicit_euler;
        s.time.rayleigh_alpha = s.time.rayleigh_beta = 0.1;
        s.time.step_s = 100;
        s.time.duration_s = 100 * scene.time.load_steps;
        for (DriveOptions& d : s.drive) d.ramp_s = s.time.duration_s;
    });
    force("every field kept", scene.output.fields.size() < 5 && scene.output.has_file(),
          [](Scene& s) {
              s.output.fields = {"stress", "von_mises", "strain_energy", "volume_change",
                                 "reactions"};
          });
    force("a result file", !scene.output.has_file(), [](Scene& s) { s.output.file = "result.h5"; });
    if (all.size() > 2) all.push_back({"with all of these", everything});
    return all;
}

/// What a scene saves by leaving parts out: the scene, and variants with one or all of them forced
/// on; times and memory, with interleaved runs. Returns the exit status.
int bench_savings(const SavingsArguments& a) {
    const Scene scene = load_scene(std::filesystem::absolute(a.scene));
    const WorkFolder folder(a.folder);
    std::vector<Variant> all = variants_of(scene);
    if (all.size() == 1)
        fail("{}: nothing is left out of it that could be forced on", a.scene.string());
    {
        ProgressLine progress("savings");
        write_hierarchy(folder / "mesh.h5", load_mesh(scene, progress.callback()));
        for (int round = 0; round < a.repeats; ++round)
            for (std::size_t k = 0; k < all.size(); ++k) {
                progress.update(static_cast<double>(round * all.size() + k) /
                                    static_cast<double>(a.repeats * all.size()),
                                all[k].name);
                Scene own = all[k].scene;
                own.mesh = MeshSource();
                own.mesh.file = folder / "mesh.h5";
                if (own.output.has_file()) own.output.file = folder / "result.h5";
                if (own.probes) own.probes->displacements = folder / "probes.csv";
                const std::filesystem::path file = folder / fmt::format("{}.yaml", k);
                write_text_file(file, to_yaml(own) + "\n");
                const SolveRun run = run_solve(fmt::format("{}", k), "", 1, file);
                if (!run.converged) fail("{}: {} does not converge", a.scene.string(), all[k].name);
                all[k].setup_s.push_back(run.partition_s + run.setup_s);
                all[k].steps_s.push_back(run.solution_s() - run.partition_s - run.setup_s);
                all[k].output_s.push_back(run.output_s);
                all[k].peak_bytes = std::max(all[k].peak_bytes, run.peak_bytes);
            }
    }
    const auto total = [](const Variant& v) {
        return distribution(v.setup_s).median + distribution(v.steps_s).median +
               distribution(v.output_s).median;
    };
    fmt::print("\n{:<32} {:>10} {:>17} {:>10} {:>9} {:>9} {:>7}\n", "", "set-up, s", "steps, s",
               "output, s", "in all", "peak, MB", "ratio");
    nlohmann::json list = nlohmann::json::array();
    for (const Variant& v : all) {
        const auto [min, max] = std::minmax_element(v.steps_s.begin(), v.steps_s.end());
        const Distribution setup = distribution(v.setup_s), steps = distribution(v.steps_s),
                           output = distribution(v.output_s);
        fmt::print("{:<32} {:>10.3f} {:>9.3f} ± {:<5.3f} {:>10.3f} {:>9.3f} {:>9.1f} {:>7.2f}\n",
                   v.name, setup.median, steps.median, (*max - *min) / 2, output.median, total(v),
                   v.peak_bytes / 1e6, total(v) / total(all.front()));
        list.push_back({{"variant", v.name},
                        {"setup_s", setup.median},
                        {"steps_s", steps.median},
                        {"output_s", output.median},
                        {"total_s", total(v)},
                        {"peak_bytes", v.peak_bytes},
                        {"ratio", total(v) / total(all.front())}});
    }
    fmt::print(
        "medians of {} rounds, each through all; ± half the way from the least to the most\n",
        a.repeats);
    if (!a.json.empty()) write_text_file(a.json, list.dump(2) + "\n");
    return 0;
}

}  // namespace

void add_savings_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "savings",
        "What a scene saves by leaving out what it does not need: the scene as it is, and with "
        "each such part forced on");
    auto a = std::make_shared<SavingsArguments>();
    command->add_option("scene", a->scene, "scene file (YAML)")->required();
    command->add_option("--repeats", a->repeats, "rounds whose median time is reported")
        ->capture_default_str()
        ->check(CLI::Range(1, 100));
    command->add_option("--folder", a->folder, "keep mesh, scenes, logs and results here");
    command->add_option("--json", a->json, "write all figures to this file");
    command->callback([a, &status] {
        check_output_files({a->json});
        status = bench_savings(*a);
    });
}

}  // namespace livetet
