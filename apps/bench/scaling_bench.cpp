#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "apps/bench/beam_mesh.hpp"
#include "apps/bench/benchmarks.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/memory_bandwidth.hpp"
#include "apps/bench/scaling_model.hpp"
#include "apps/bench/solve_run.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"
#include "base/work_folder.hpp"
#include "io/hierarchy_file.hpp"
#ifdef LIVETET_IMAGES
#include "apps/plots/pictures.hpp"
#endif

namespace livetet {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// `livetet bench scaling`.
struct ScalingArguments {
    std::vector<int> ranks{1, 2, 4, 8, 16};
    double unknowns = 3e6;
    int refine = 2;  ///< uniform refinements of the mesh
    std::string launcher =
        "mpirun --oversubscribe -n {}";  ///< prefix of the command, with {} for the number of ranks
    std::vector<std::string> others{"gamg", "boomeramg"};
    std::filesystem::path folder;  ///< keeps meshes, scenes and results; empty: a temporary folder
    std::filesystem::path json, figure;
};

/// Edge length of a beam's mesh with this number of unknowns after refinement. A tet has a volume
/// of about 0.2 e^3, and there are 5.75 tets to a node.
double edge_for(double unknowns, int refine) {
    const double tets = unknowns / 3 * 5.75 / std::pow(8, refine);
    return std::cbrt(4.955 * 0.002 / tets);
}

/// What a run differs in from others on its mesh.
struct Variant {
    std::string kind = "multigrid";
    bool assembled = false;  ///< the finest level's operator
    bool ten_nodes = false;

    std::string name() const {
        return kind + (assembled ? "_assembled" : "") + (ten_nodes ? "_P2" : "");
    }
};

std::string scene_text(const std::string& mesh, int refine, const Variant& variant,
                       const std::string& result) {
    return fmt::format(
        "mesh: {{file: {}, refine: {}}}\n"
        "elements: {}\n"
        "materials: [{{young_Pa: 5000, poisson: 0.45}}]\n"
        "fix: [{{half_space_mm: [0.001, 0, 0, 1, 0, 0]}}]\n"
        "drive: [{{box_mm: [83.5, 33.5, 99.999, 116.5, 66.5, 100.001], displacement_mm: [0, 0, "
        "-5]}}]\n"
        "solver: {{kind: {}, finest: {}, relative_tolerance: 1.0e-3, newton_tolerance: 1.0e-8, "
        "max_iterations: 2000}}\n"
        "output: {{file: {}}}\n",
        mesh, refine, variant.ten_nodes ? "P2" : "P1", variant.kind,
        variant.assembled ? "assembled" : "automatic", result);
}

void check_kind(const std::string& kind) {
    if (kind != "multigrid" && kind != "gamg" && kind != "boomeramg")
        fail("--compare {}: expected gamg or boomeramg", kind);
}

void print_runs(const std::vector<SolveRun>& runs) {
    fmt::print(
        "\n{:<34} {:>5} {:>10} | {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} | {:>8} | {:>6} "
        "{:>6} | {:>6} | {:>9} {:>9} {:>7}\n",
        "", "ranks", "unknowns", "mesh", "part.", "set-up", "forces", "assem.", "prec.", "solve",
        "output", "solution", "linea-", "iter. ", "kB an", "messages", "MB sent", "reduc-");
    fmt::print(
        "{:<34} {:>5} {:>10} | {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} | {:>8} | {:>6} "
        "{:>6} | {:>6} | {:>9} {:>9} {:>7}\n",
        "", "", "", "s", "s", "s", "s", "s", "s", "s", "s", "s", "risat.", "a one", "unkn.", "", "",
        "tions");
    for (const SolveRun& r : runs)
        fmt::print(
            "{:<34} {:>5} {:>10.0f} | {:>6.1f} {:>6.1f} {:>6.1f} {:>6.1f} {:>6.1f} {:>6.1f} "
            "{:>6.1f} {:>6.1f} | {:>8.1f} | {:>6} {:>6.1f} | "
            "{:>6.2f} | {:>9.0f} {:>9.1f} {:>7.0f}{}\n",
            r.name, r.ranks, r.unknowns, r.mesh_s, r.partition_s, r.setup_s, r.forces_s,
            r.assembly_s, r.preconditioner_s, r.linear_s, r.output_s, r.solution_s(),
            r.newton_iterations, r.iterations_a_solve(), r.bytes_an_unknown() / 1e3, r.messages,
            r.message_bytes / 1e6, r.reductions, r.converged ? "" : "  NOT converged");
}

/// Targets of memory are those of up to so many ranks; what more take is told.
constexpr int most_judged_for_memory = 8;

/// Prints a line for a target. Returns `holds`.
bool judge(const std::string& what, double value, const std::string& target, bool holds) {
    fmt::print("{:<70} {:>8.2f}   target {:<13} {}\n", what, value, target,
               holds ? "holds" : "MISSED");
    return holds;
}

/// Times are judged on numbers of ranks that the cores allow, memory and iterations on all, at a
/// quarter of the size.
struct ScalingRuns {
    std::vector<SolveRun> strong, weak, others;
    std::optional<SolveRun> assembled;  ///< of `strong`, with a matrix on the finest level
    std::vector<SolveRun> ten_nodes;    ///< half the size: without that matrix, and with it
    std::vector<SolveRun> spread;       ///< a quarter of the size, on all numbers of ranks
    std::optional<SolveRun> part;       ///< of that, on one rank what each of those judged has
    int ranks_of_part = 0;              ///< how many those are
    std::vector<SolveRun> of_nothing;   ///< the least mesh, on one rank and on the most
    int judged_ranks = 1;               ///< the most that the cores allow

    std::vector<SolveRun> all() const {
        std::vector<SolveRun> all = strong;
        if (assembled) all.push_back(*assembled);
        for (const auto* more : {&ten_nodes, &weak, &others, &spread, &of_nothing})
            all.insert(all.end(), more->begin(), more->end());
        if (part) all.push_back(*part);
        return all;
    }
};

/// The run on so many ranks; null if there is none.
const SolveRun* on_ranks(const std::vector<SolveRun>& runs, int ranks) {
    const auto found = std::ranges::find(runs, ranks, &SolveRun::ranks);
    return found == runs.end() ? nullptr : &*found;
}

ScalingRuns measure_runs(const ScalingArguments& a, int cores) {
    const WorkFolder folder(a.folder);
    ProgressLine progress("scaling");
    const auto mesh = [&](double unknowns, int refine, const std::string& name) {
        progress.update(0, "mesh of " + name);
        write_hierarchy(folder / (name + ".h5"), mesh_beam(edge_for(unknowns, refine), {}));
    };
    const auto [fewest, most] = std::ranges::minmax(a.ranks);
    ScalingRuns runs;
    runs.judged_ranks = fewest;
    for (const int ranks : a.ranks)
        if (ranks <= cores) runs.judged_ranks = std::max(runs.judged_ranks, ranks);
    const auto judged = static_cast<std::size_t>(
        std::ranges::count_if(a.ranks, [&](int ranks) { return ranks <= runs.judged_ranks; }));
    const std::size_t total = 2 * judged + a.others.size() + a.ranks.size() + 6;
    std::size_t count = 0;
    const auto run = [&](const std::string& name, const std::string& of_mesh,
                         const Variant& variant, int ranks) {
        const std::string file = of_mesh + "_" + variant.name();
        const fs::path scene = folder / (file + ".yaml");
        write_text_file(scene, scene_text(of_mesh + ".h5", a.refine, variant, file + ".result.h5"));
        progress.update(static_cast<double>(count++) / static_cast<double>(total),
                        fmt::format("{} on {} ranks", name, ranks));
        return run_solve(name, a.launcher, ranks, scene);
    };
    mesh(a.unknowns, a.refine, "whole");
    for (const int ranks : a.ranks)
        if (ranks <= runs.judged_ranks)
            runs.strong.push_back(run("multigrid, one size", "whole", {}, ranks));
    for (const int ranks : a.ranks) {
        if (ranks > runs.judged_ranks) continue;
        const std::string name = fmt::format("weak{}", ranks);
        mesh(a.unknowns * ranks / runs.judged_ranks, a.refine, name);
        runs.weak.push_back(run("multigrid, one size a rank", name, {}, ranks));
    }
    for (const std::string& kind : a.others)
        runs.others.push_back(run(kind + ", one size", "whole", {kind}, runs.judged_ranks));
    const int ranks_of_all = runs.judged_ranks;
    runs.assembled = run("the same, assembled", "whole", {.assembled = true}, ranks_of_all);
    // Ten-node tets halve edges once more; a beam cut into less than this has no mesh.
    const double least = 200 * std::pow(8, a.refine + 1);
    mesh(std::max(a.unknowns / 2, least), a.refine + 1, "half");
    for (const bool assembled : {false, true})
        runs.ten_nodes.push_back(
            run(assembled ? "the same, assembled" : "ten-node tets, half of it", "half",
                {.assembled = assembled, .ten_nodes = true}, ranks_of_all));
    mesh(a.unknowns / 4, a.refine, "quarter");
    for (const int ranks : a.ranks)
        runs.spread.push_back(run("multigrid, a quarter", "quarter", {}, ranks));
    if (fewest > 1 || most < 2) return runs;
    for (const int ranks : a.ranks)
        if (ranks <= most_judged_for_memory)
            runs.ranks_of_part = std::max(runs.ranks_of_part, ranks);
    mesh(a.unknowns / 4 / runs.ranks_of_part, a.refine, "part");
    runs.part = run(fmt::format("the same, 1/{}", runs.ranks_of_part), "part", {}, 1);
    mesh(200 * std::pow(8, a.refine), a.refine, "nothing");
    for (const int ranks : {1, most})
        runs.of_nothing.push_back(run("next to nothing", "nothing", {}, ranks));
    return runs;
}

/// Time against other preconditioners, against one rank, and of set-up.
bool judge_times(const ScalingRuns& runs, int cores, double bandwidth_ratio) {
    bool good = true;
    const SolveRun *one = on_ranks(runs.strong, 1), *two = on_ranks(runs.strong, 2);
    const SolveRun& ours = *on_ranks(runs.strong, runs.judged_ranks);
    for (const SolveRun& r : runs.others) {
        const double least = r.name.starts_with("gamg") ? 8 : 12;
        good &= judge(fmt::format("{}: times multigrid's time to solution", r.name),
                      r.solution_s() / ours.solution_s(), fmt::format(">= {}", least),
                      r.solution_s() >= least * ours.solution_s());
    }
    const auto begin_s = [](const SolveRun& r) { return r.mesh_s + r.partition_s + r.setup_s; };
    const double most_s = 3 * ours.unknowns / 3e6;
    good &= judge("s to read, partition and set up, elements and matrices with it", begin_s(ours),
                  fmt::format("<= {:.3g}", most_s), begin_s(ours) <= most_s);
    if (!one || !two || cores < 2) return good;
    good &= judge("the same, two ranks over one", begin_s(*two) / begin_s(*one), "<= 1",
                  begin_s(*two) <= begin_s(*one));
    const double faster = one->solution_s() / two->solution_s();
    good &= judge("speed-up of two ranks over one", faster, ">= 1.7", faster >= 1.7);
    fmt::print("{:<70} {:>8.2f}   (bandwidth of {} cores over that of one)\n",
               "  limit by memory bandwidth: about", bandwidth_ratio, cores);
    return good;
}

/// The finest level without a matrix against the same with one.
bool judge_matrix_free(const ScalingRuns& runs) {
    const SolveRun &four = *on_ranks(runs.strong, runs.judged_ranks), &ten = runs.ten_nodes[0];
    const double memory = ten.bytes_an_unknown() / 1e3,
                 share = ten.bytes_an_unknown() / runs.ten_nodes[1].bytes_an_unknown();
    bool good = judge("ten-node tets: kB an unknown", memory, "<= 0.8", memory <= 0.8);
    good &= judge("ten-node tets: memory over that with a matrix", share, "<= 0.5", share <= 0.5);
    fmt::print("{:<70} {:>8.2f}   four-node tets {:.2f}\n",
               "ten-node tets: time to solution with a matrix over that without",
               runs.ten_nodes[1].solution_s() / ten.solution_s(),
               runs.assembled->solution_s() / four.solution_s());
    return good;
}

/// Memory an unknown, and how it falls and grows with the number of ranks.
bool judge_memory(const ScalingRuns& runs) {
    double memory = 0;
    for (const SolveRun& r : runs.strong) memory = std::max(memory, r.bytes_an_unknown() / 1e3);
    bool good =
        judge("kB an unknown at the peak, all ranks together", memory, "<= 1.2", memory <= 1.2);
    if (!runs.part) return good;
    const SolveRun &of_one = runs.of_nothing.front(), &of_most = runs.of_nothing.back();
    const SolveRun& one = *on_ranks(runs.spread, 1);
    for (const SolveRun& r : runs.spread) {
        if (r.ranks == 1) continue;
        // On few ranks the program takes about what it takes on one.
        const double program =
            r.ranks == of_most.ranks ? of_most.peak_bytes_most : of_one.peak_bytes_most;
        const double share = (r.peak_bytes_most - program) * r.ranks /
                             (one.peak_bytes_most - of_one.peak_bytes_most);
        const std::string what =
            fmt::format("memory of the largest of {} ranks over its part of one's", r.ranks);
        if (r.ranks <= most_judged_for_memory)
            good &= judge(what, share, "<= 1.3", share <= 1.3);
        else
            fmt::print("{:<70} {:>8.2f}\n", what, share);
    }
    const double growth = 100 * (on_ranks(runs.spread, runs.ranks_of_part)->peak_bytes_most /
                                     runs.part->peak_bytes_most -
                                 1);
    good &= judge(fmt::format("growth of a rank's memory, 1 to {} ranks with as much each, %",
                              runs.ranks_of_part),
                  growth, "<= 10", growth <= 10);
    return good;
}

/// Prints a line for each target. `bandwidth_ratio`: of all cores to one. True if all targets hold.
bool judge_runs(const ScalingRuns& runs, int cores, double bandwidth_ratio) {
    bool good = std::ranges::all_of(runs.all(), &SolveRun::converged);
    if (!good) fmt::print("a run did not converge: its times cannot be compared\n");
    good &= judge_times(runs, cores, bandwidth_ratio);
    good &= judge_matrix_free(runs);
    good &= judge_memory(runs);
    const auto [fewest, greatest] =
        std::ranges::minmax(runs.spread, {}, &SolveRun::iterations_a_solve);
    const double apart = greatest.iterations_a_solve() - fewest.iterations_a_solve();
    good &= judge("iterations a linear solve: largest difference between ranks", apart, "<= 1",
                  apart <= 1);
    return good;
}

/// A pressed beam, corotated and static, solved from zero to 1e-8 on one rank and more, and at a
/// fixed size a rank; the same by other preconditioners; a quarter of it on more ranks than there
/// are cores; seconds by phase, memory, messages; and a model of 10^3 to 10^5 ranks from these.
/// Returns 1 if a target is missed. Starts `livetet solve` by the launcher, so it must not run
/// under mpirun itself.
int bench_scaling(const ScalingArguments& a) {
    if (a.ranks.empty() || *std::min_element(a.ranks.begin(), a.ranks.end()) < 1)
        fail("--ranks: expected numbers from 1 on");
    std::ranges::for_each(a.others, check_kind);
    const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    const double of_one = measure_bandwidth(1), of_all = measure_bandwidth(cores);
    fmt::print("memory bandwidth: {:.1f} GB/s on one core, {:.1f} on {}\n", of_one / 1e9,
               of_all / 1e9, cores);
    const ScalingRuns measured = measure_runs(a, cores);
    const std::vector<SolveRun> all = measured.all();
    print_runs(all);
    fmt::print("\n");
    const bool good = judge_runs(measured, cores, of_all / of_one);
    const ScalingModel model(measured.weak.back(),
                             *std::ranges::max_element(measured.spread, {}, &SolveRun::ranks),
                             a.refine);
    print(model);
    if (!a.json.empty()) {
        json runs = json::array();
        for (const SolveRun& r : all) runs.push_back(json_of(r));
        write_text_file(a.json, json{{"bandwidth_of_one", of_one},
                                     {"bandwidth_of_all", of_all},
                                     {"runs", runs},
                                     {"model", json_of(model)}}
                                        .dump(2) +
                                    "\n");
    }
#ifdef LIVETET_IMAGES
    if (!a.figure.empty()) {
        const WorkPrecisionChart chart{"Time of an iteration at 10^5 unknowns a rank, by the model",
                                       "seconds", lines_of(model), "ranks"};
        write_work_precision_picture(a.figure, std::span(&chart, 1));
    }
#endif
    return good ? 0 : 1;
}

}  // namespace

void add_scaling_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "scaling",
        "Strong and weak scaling of a pressed beam under mpirun, by phase, compared with GAMG and "
        "BoomerAMG, and a model of 10^3 to 10^5 ranks; exit status 1 if a target is missed");
    auto a = std::make_shared<ScalingArguments>();
    command
        ->add_option("--ranks", a->ranks,
                     "numbers of ranks; those above that of the cores solve a quarter of the "
                     "size, for their memory and iterations")
        ->delimiter(',')
        ->capture_default_str();
    command->add_option("--unknowns", a->unknowns, "approximate number of unknowns")
        ->capture_default_str()
        ->check(CLI::Range(1e3, 1e10));
    command
        ->add_option("--refine", a->refine,
                     "number of uniform refinements of the mesh, each tet into eight")
        ->capture_default_str()
        ->check(CLI::Range(0, 4));
    command->add_option("--compare", a->others, "preconditioners to compare: gamg, boomeramg")
        ->delimiter(',')
        ->capture_default_str();
    command
        ->add_option("--launcher", a->launcher,
                     "command that starts a run, with {} for the number of ranks: srun -n {}")
        ->capture_default_str();
    command->add_option("--folder", a->folder, "keep meshes, scenes, logs and results here");
    command->add_option("--json", a->json, "write all figures to this file");
    add_figure_option(*command, "--figure", a->figure, "draw the model to this PNG");
    command->callback([a, &status] {
        check_output_files({a->json});
        check_figures({a->figure});
        status = bench_scaling(*a);
    });
}

}  // namespace livetet
