#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>

#include "apps/bench/accuracy_population.hpp"
#include "apps/bench/accuracy_result.hpp"
#include "apps/bench/accuracy_run.hpp"
#include "apps/bench/benchmarks.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/realtime_cases.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

/// `livetet bench accuracy`.
struct AccuracyArguments {
    int seeds = 100;
    int other_seeds = 10;    ///< of other bodies
    int bodies = 10;         ///< drawn from the stated spreads
    int body_seeds = 10;     ///< of each of them
    int limit_seeds = 20;    ///< of what limits the errors, at most
    int sensors = 6;         ///< at most
    int tets = 6000;         ///< of the model, P2
    int truth_tets = 10000;  ///< of the truth, P2
    std::filesystem::path json, csv, figure, calibration;
};

constexpr TrackerKind trackers[] = {{1.4, 0.5},
                                    {0.5, 0.2}};  // as stated by makers of electromagnetic trackers

MeshHierarchy mesh_model(const PhantomImages& images, int tets, const ProgressCallback& progress) {
    return mesh_phantom(images, {"", tets, 0, 0, 0}, progress);
}

/// All seeds' runs of a case.
AccuracySeries run_seeds(AccuracyModel& model, AccuracyCase c, int seeds,
                         const ProgressCallback& progress = {}) {
    AccuracySeries series;
    for (int seed = 1; seed <= seeds; ++seed) {
        if (progress)
            progress(static_cast<double>(seed - 1) / seeds,
                     fmt::format("run {} of {}", seed, seeds));
        c.seed = static_cast<std::uint64_t>(seed);
        series.runs.push_back(model.run(c));
    }
    return series;
}

AccuracyTable fill_table(AccuracyModel& model, const PressedOrgan& organ,
                         const TrackerKind& tracker, const AccuracyArguments& arguments,
                         ProgressLine& progress, double from, double to) {
    AccuracyTable table{tracker, {}, true_motion_mm(organ.truth), {}};
    for (const double depth : organ.truth.depths) table.depths_mm.push_back(1e3 * depth);
    const int most = arguments.sensors;
    for (int sensors = 1; sensors <= most; ++sensors)
        table.by_sensors.push_back(run_seeds(
            model, {tracker.position_rms_mm, tracker.rotation_rms_deg, sensors}, arguments.seeds,
            [&](double fraction, std::string_view what) {
                progress.update(from + (to - from) * (sensors - 1 + fraction) / most,
                                fmt::format("{} mm, {} of {} sensors, {}", tracker.position_rms_mm,
                                            sensors, most, what));
            }));
    return table;
}

/// One sensor, and as many as there are at most.
std::vector<int> one_and_most(const AccuracyArguments& arguments) {
    return arguments.sensors > 1 ? std::vector{1, arguments.sensors} : std::vector{1};
}

/// Errors with causes removed one after the other: the tracker's noise, the organ's motion, then
/// the model's parts: its mesh by one of three times as many tets, its material by another, its
/// elements.
std::vector<NamedSeries> find_limits(AccuracyModel& model, const MeshHierarchy& hierarchy,
                                     const PressedOrgan& organ, const PhantomImages& images,
                                     const std::vector<AccuracyTable>& tables,
                                     const AccuracyArguments& arguments, ProgressLine& progress) {
    std::vector<NamedSeries> limits;
    const int some = std::min(arguments.seeds, arguments.limit_seeds);
    const std::vector<int> sensor_counts = one_and_most(arguments);
    const auto add = [&](const std::string& name, AccuracyModel& with, AccuracyCase c, int runs) {
        progress.update(0.9 + 0.005 * static_cast<double>(limits.size()), "limits: " + name);
        limits.push_back({name, c.sensors, run_seeds(with, c, runs)});
    };
    const auto [position, rotation] = tables.front().tracker;
    for (const AccuracyTable& t : tables)
        for (const int sensors : sensor_counts)
            limits.push_back({fmt::format("as above, tracker of {} mm", t.tracker.position_rms_mm),
                              sensors, t.by_sensors[sensors - 1]});
    add(fmt::format("tracker of {} mm", position), model, {position, rotation, max_true_sensors},
        some);
    for (const int sensors : sensor_counts)
        add(fmt::format("tracker of {} mm, organ still: no lag", position), model,
            {position, rotation, sensors, 1, false}, some);
    add("no noise, organ moving: the filter's lag", model, {0, 0, 1}, some);
    for (const int sensors : sensor_counts)
        add("no noise, organ still: model, mesh, sensors", model, {0, 0, sensors, 1, false}, 1);
    add("no noise, organ still: model, mesh, sensors", model, {0, 0, max_true_sensors, 1, false},
        1);
    {
        AccuracyModel finer(accuracy_scene(), mesh_model(images, 3 * arguments.tets, {}), organ);
        for (const int sensors : sensor_counts)
            add(fmt::format("... on {} tets", finer.mesh().tets.size()), finer,
                {0, 0, sensors, 1, false}, 1);
    }
    Scene scene = accuracy_scene();
    scene.strain = "corotated";
    {
        AccuracyModel other(scene, hierarchy, organ);
        add("... of a corotated material", other, {0, 0, 1, 1, false}, 1);
    }
    scene = accuracy_scene();
    scene.elements = Elements::p1;
    AccuracyModel elements(scene, hierarchy, organ);
    for (const int sensors : sensor_counts)
        add("... of four-node elements", elements, {0, 0, sensors, 1, false}, 1);
    return limits;
}

/// A true body that is not as the model takes it to be.
struct OtherBody {
    std::string name;
    std::uint64_t image_seed;
    TrueBody body;
};

/// The statement's errors on bodies that it was not made on. The scene states the spread that their
/// values are from.
std::vector<NamedSeries> press_other_bodies(const AccuracyArguments& arguments,
                                            std::vector<double> depths, ProgressLine& progress) {
    const double radius = TrueBody{}.patch_radius;
    const OtherBody bodies[] = {
        {"images and meshes of another seed", 2, {}},
        {"nu 0.42 for 0.45 +- 0.03", 1, {.poisson = 0.42}},
        {"nu 0.47 for 0.45 +- 0.03", 1, {.poisson = 0.47}},
        {"a disc of 0.85 times the radius", 1, {.patch_radius = 0.85 * radius}},
        {"a disc of 1.15 times the radius", 1, {.patch_radius = 1.15 * radius}}};
    std::vector<NamedSeries> all;
    for (const OtherBody& other : bodies) {
        const double done = static_cast<double>(&other - bodies) / std::size(bodies);
        progress.update(0.75 + 0.15 * done, "other bodies: " + other.name);
        const PhantomImages images = make_phantom_images(0.0015, other.image_seed);
        const PressedOrgan organ =
            press_organ(images, arguments.truth_tets, depths, {}, other.body);
        Scene scene = accuracy_scene();
        if (other.body.poisson != TrueBody{}.poisson) scene.materials[0].poisson.spread = 0.03;
        const int tets = other.image_seed == 1 ? arguments.tets : 3 * arguments.tets / 2;
        AccuracyModel model(scene, mesh_model(images, tets, {}), organ);
        for (const TrackerKind& tracker : trackers)
            for (const int sensors : one_and_most(arguments))
                all.push_back(
                    {fmt::format("{}, tracker of {} mm", other.name, tracker.position_rms_mm),
                     sensors,
                     run_seeds(model, {tracker.position_rms_mm, tracker.rotation_rms_deg, sensors},
                               arguments.other_seeds)});
    }
    return all;
}

/// `group`: names the bodies whose cells were judged.
void print_statement_verdict(const AccuracyVerdict& verdict, std::string_view group) {
    fmt::print(
        "\n{}: the 95 % radius covers 92 to 98 % of the errors, and its median is at most 2.5 "
        "times theirs, in {} of {} cells{}\n",
        group, verdict.cells - static_cast<int>(verdict.lost.size()), verdict.cells,
        verdict.lost.empty() ? "" : "; not in:");
    for (const std::string& cell : verdict.lost) fmt::print("  {}\n", cell);
}

int print_verdict(const AccuracyVerdict& verdict) {
    if (verdict.lost.empty()) {
        fmt::print(
            "\ndeforming is better than rigid-only in all {} cells where the press is larger than "
            "the noise\n",
            verdict.cells);
        return 0;
    }
    fmt::print(
        "\ndeforming is NOT better than rigid-only in {} of {} cells where the press is larger "
        "than the noise:\n",
        verdict.lost.size(), verdict.cells);
    for (const std::string& cell : verdict.lost) fmt::print("  {}\n", cell);
    return 1;
}

/// What the benchmark found.
struct AccuracyFindings {
    std::vector<AccuracyTable> tables;
    std::vector<AccuracyTable> population;  ///< of drawn bodies
    std::vector<NamedSeries> other_bodies;
    std::vector<NamedSeries> limits;
};

/// How the statement does: over drawn bodies, and on each body by itself.
void judge_statements(AccuracyFindings& found, const std::vector<double>& depths,
                      const AccuracyArguments& arguments, ProgressLine& progress) {
    if (arguments.bodies > 0) {
        found.population = press_population(
            {arguments.bodies, arguments.body_seeds, arguments.sensors, arguments.tets,
             arguments.truth_tets},
            trackers, depths, [&](double fraction, std::string_view words) {
                progress.update(0.5 + 0.25 * fraction, fmt::format("drawn bodies: {}", words));
            });
        print_population(found.population, arguments.bodies);
        print_statement_verdict(judge_statement(found.population, {}), "drawn bodies");
    }
    if (arguments.other_seeds > 0) {
        found.other_bodies = press_other_bodies(arguments, depths, progress);
        print_other_bodies(found.other_bodies, found.tables.front().depths_mm);
    }
    print_statement_verdict(judge_statement(found.tables, found.other_bodies),
                            "each body by itself");
}

void write_json(const std::filesystem::path& path, const PressedOrgan& organ,
                const AccuracyModel& model, const AccuracyFindings& found) {
    nlohmann::json result{{"truth", organ.truth.provenance},
                          {"model_elements", "P2"},
                          {"model_tets", model.mesh().tets.size()}};
    const std::vector<double>& depths_mm = found.tables.front().depths_mm;
    for (const AccuracyTable& t : found.tables) result["tables"].push_back(json_of(t));
    for (const AccuracyTable& t : found.population) result["drawn_bodies"].push_back(json_of(t));
    for (const NamedSeries& b : found.other_bodies)
        result["other_bodies"].push_back(json_of(b, depths_mm));
    for (const NamedSeries& l : found.limits) result["limits"].push_back(json_of(l, depths_mm));
    write_text_file(path, result.dump(2) + "\n");
}

/// The calibration is drawn of the population where there is one: there the diagonal is the aim.
void draw(const AccuracyArguments& arguments, const AccuracyFindings& found) {
    const auto& calibrated = found.population.empty() ? found.tables : found.population;
    const auto write = [](const std::filesystem::path& path, const auto& tables, auto chart) {
        if (path.empty()) return;
        std::vector<SpreadChart> charts;
        for (const AccuracyTable& t : tables) charts.push_back(chart(t));
        write_spread_picture(path, charts);
    };
    write(arguments.figure, found.tables, &chart_of);
    write(arguments.calibration, calibrated, &calibration_chart_of);
}

/// Error at targets inside the pressed phantom, rigid-only and deforming, by tracker noise, depth
/// of the press and number of sensors, and what limits it. Returns 1 unless deforming is better in
/// every cell.
int bench_accuracy(const AccuracyArguments& arguments) {
    PetscSession session("livetet", {});
    if (session.ranks() > 1)
        fail("bench accuracy runs on one rank, found {}: start it without mpirun", session.ranks());
    ProgressLine progress("accuracy");
    const auto part = [&](double from, double to, const std::string& what) -> ProgressCallback {
        return [&progress, from, to, what](double fraction, std::string_view words) {
            progress.update(from + (to - from) * fraction, fmt::format("{}: {}", what, words));
        };
    };

    // 1. the true organ, and the mesh of the model
    const PhantomImages images = make_phantom_images(0.0015, 1);
    const PressedOrgan organ =
        press_organ(images, arguments.truth_tets, {0.005, 0.010, 0.015, 0.020, 0.025, 0.030},
                    part(0, 0.2, "truth"));
    const MeshHierarchy hierarchy = mesh_model(images, arguments.tets, part(0.2, 0.22, "model"));
    AccuracyModel model(accuracy_scene(), hierarchy, organ);
    fmt::print("truth: {}\nmodel: neo-Hookean, {} P2 tets, {} nodes; {} of {} targets judged\n",
               organ.truth.provenance, model.mesh().tets.size(), model.mesh().nodes.size(),
               judged_targets(organ.truth).size(), organ.truth.targets.size());

    // 2. all cells, the statement, and the limits
    AccuracyFindings found;
    for (const TrackerKind& tracker : trackers) {
        const double from = 0.22 + 0.14 * static_cast<double>(found.tables.size());
        found.tables.push_back(
            fill_table(model, organ, tracker, arguments, progress, from, from + 0.14));
        print(found.tables.back());
        print_statement(found.tables.back());
    }
    judge_statements(found, organ.truth.depths, arguments, progress);
    if (arguments.limit_seeds > 0) {
        found.limits =
            find_limits(model, hierarchy, organ, images, found.tables, arguments, progress);
        print(found.limits, found.tables.front().depths_mm);
    }

    // 3. files and verdict
    if (!arguments.json.empty()) write_json(arguments.json, organ, model, found);
    if (!arguments.csv.empty()) write_text_file(arguments.csv, csv_of(found.tables));
    draw(arguments, found);
    return print_verdict(judge(found.tables));
}

}  // namespace

void add_accuracy_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "accuracy",
        "Error at targets inside the pressed phantom, rigid against deforming registration, and "
        "what limits it; exit status 1 if rigid is better in any cell");
    auto a = std::make_shared<AccuracyArguments>();
    command->add_option("--seeds", a->seeds, "runs of each cell")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000));
    command
        ->add_option("--other-seeds", a->other_seeds,
                     "runs of each cell with five other bodies, for the stated errors; 0: none")
        ->capture_default_str()
        ->check(CLI::Range(0, 100000));
    command
        ->add_option("--bodies", a->bodies,
                     "bodies drawn from the spreads that the scene states, for the stated errors; "
                     "0: none")
        ->capture_default_str()
        ->check(CLI::Range(0, most_drawn_bodies));
    command->add_option("--body-seeds", a->body_seeds, "runs of each cell with each drawn body")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    command
        ->add_option("--limit-seeds", a->limit_seeds,
                     "runs of each cell, at most, where causes of the errors are taken away one by "
                     "one; 0: none")
        ->capture_default_str()
        ->check(CLI::Range(0, 100000));
    command->add_option("--sensors", a->sensors, "each number of sensors up to this one")
        ->capture_default_str()
        ->check(CLI::Range(1, 6));
    command->add_option("--tets", a->tets, "ten-node tets of the model")
        ->capture_default_str()
        ->check(CLI::Range(500, 1000000));
    command->add_option("--truth-tets", a->truth_tets, "ten-node tets of the true organ")
        ->capture_default_str()
        ->check(CLI::Range(500, 1000000));
    command->add_option("--json", a->json, "write the errors of every cell to this file");
    command->add_option("--csv", a->csv, "write the errors of every run to this file");
    add_figure_option(*command, "--figure", a->figure,
                      "draw errors and their spread against the depth of the press to this PNG");
    add_figure_option(*command, "--calibration", a->calibration,
                      "draw the share of the errors that are no larger than stated with each "
                      "probability to this PNG: of drawn bodies, unless --bodies is 0");
    command->callback([a, &status] {
        check_output_files({a->json, a->csv});
        check_figures({a->figure, a->calibration});
        status = bench_accuracy(*a);
    });
}

}  // namespace livetet
