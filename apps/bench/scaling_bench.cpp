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
    std::vector<int> ranks{
        1, 2,
        4};  ///< strong scaling; numbers above that of the cores are run for their iterations only
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

std::string scene_text(const std::string& mesh, int refine, const std::string& solver,
                       const std::string& result) {
    return fmt::format(
        "mesh: {{file: {}, refine: {}}}\n"
        "materials: [{{young_Pa: 5000, poisson: 0.45}}]\n"
        "fix: [{{half_space_mm: [0.001, 0, 0, 1, 0, 0]}}]\n"
        "drive: [{{box_mm: [83.5, 33.5, 99.999, 116.5, 66.5, 100.001], displacement_mm: [0, 0, "
        "-5]}}]\n"
        "solver: {{{}, newton_tolerance: 1.0e-8, max_iterations: 2000}}\n"
        "output: {{file: {}}}\n",
        mesh, refine, solver, result);
}

std::string solver_of(const std::string& kind) {
    if (kind != "multigrid" && kind != "gamg" && kind != "boomeramg")
        fail("--compare {}: expected gamg or boomeramg", kind);
    return "kind: " + kind + ", relative_tolerance: 1.0e-3";
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

/// Prints a line for a target. Returns `holds`.
bool judge(const std::string& what, double value, const std::string& target, bool holds) {
    fmt::print("{:<70} {:>8.2f}   target {:<13} {}\n", what, value, target,
               holds ? "holds" : "MISSED");
    return holds;
}

/// The runs, and the largest number of ranks judged for time: the largest requested one that the
/// cores allow, else the smallest.
struct ScalingRuns {
    std::vector<SolveRun> strong, weak, others;
    int judged_ranks = 1;

    std::vector<SolveRun> all() const {
        std::vector<SolveRun> all = strong;
        all.insert(all.end(), weak.begin(), weak.end());
        all.insert(all.end(), others.begin(), others.end());
        return all;
    }
};

ScalingRuns measure_runs(const ScalingArguments& a, int cores) {
    const WorkFolder folder(a.folder);
    ProgressLine progress("scaling");
    const auto mesh = [&](double unknowns, int refine, const std::string& name) {
        progress.update(0, "mesh of " + name);
        write_hierarchy(folder / (name + ".h5"), mesh_beam(edge_for(unknowns, refine), {}));
    };
    const std::size_t total = 2 * a.ranks.size() + a.others.size();
    std::size_t count = 0;
    const auto run = [&](const std::string& name, const std::string& of_mesh,
                         const std::string& kind, int ranks) {
        const fs::path scene = folder / fmt::format("{}_{}.yaml", of_mesh, kind);
        write_text_file(scene, scene_text(of_mesh + ".h5", a.refine, solver_of(kind),
                                          fmt::format("{}_{}.h5", of_mesh, kind) + ".result.h5"));
        progress.update(static_cast<double>(count++) / static_cast<double>(total),
                        fmt::format("{} on {} ranks", name, ranks));
        return run_solve(name, a.launcher, ranks, scene);
    };
    mesh(a.unknowns, a.refine, "whole");
    ScalingRuns runs;
    for (const int ranks : a.ranks)
        runs.strong.push_back(run("multigrid, one size", "whole", "multigrid", ranks));
    runs.judged_ranks = *std::min_element(a.ranks.begin(), a.ranks.end());
    for (const int ranks : a.ranks)
        if (ranks <= cores) runs.judged_ranks = std::max(runs.judged_ranks, ranks);
    for (const int ranks : a.ranks) {
        if (ranks > runs.judged_ranks) continue;
        const std::string name = fmt::format("weak{}", ranks);
        mesh(a.unknowns * ranks / runs.judged_ranks, a.refine, name);
        runs.weak.push_back(run("multigrid, one size a rank", name, "multigrid", ranks));
    }
    for (const std::string& kind : a.others)
        runs.others.push_back(run(kind + ", one size", "whole", kind, runs.judged_ranks));
    return runs;
}

/// Prints a line for each target. `bandwidth_ratio`: of all cores to one. True if all targets hold.
bool judge_runs(const ScalingRuns& runs, int cores, double bandwidth_ratio) {
    const auto& strong = runs.strong;
    const auto by_ranks = [&](int ranks) {
        return std::find_if(strong.begin(), strong.end(),
                            [&](const SolveRun& r) { return r.ranks == ranks; });
    };
    const std::vector<SolveRun> all = runs.all();
    bool good = std::all_of(all.begin(), all.end(), [](const SolveRun& r) { return r.converged; });
    if (!good) fmt::print("a run did not converge: its times cannot be compared\n");
    const auto one = by_ranks(1), two = by_ranks(2), ours = by_ranks(runs.judged_ranks);
    for (const SolveRun& r : runs.others) {
        const double least = r.name.starts_with("gamg") ? 3 : 5;
        good &= judge(fmt::format("{}: times multigrid's time to solution", r.name),
                      r.solution_s() / ours->solution_s(), fmt::format(">= {}", least),
                      r.solution_s() >= least * ours->solution_s());
    }
    double memory = 0;
    for (const SolveRun& r : strong)
        if (r.ranks <= runs.judged_ranks) memory = std::max(memory, r.bytes_an_unknown() / 1e3);
    good &= judge("kB an unknown at the peak, all ranks together", memory, "<= 1.5", memory <= 1.5);
    if (one != strong.end() && two != strong.end() && cores >= 2) {
        const double faster = one->solution_s() / two->solution_s();
        good &= judge("speed-up of two ranks over one", faster, ">= 1.7", faster >= 1.7);
        fmt::print("{:<70} {:>8.2f}   (bandwidth of {} cores over that of one)\n",
                   "  limit by memory bandwidth: about", bandwidth_ratio, cores);
    }
    const auto [fewest, greatest] =
        std::minmax_element(strong.begin(), strong.end(), [](const SolveRun& x, const SolveRun& y) {
            return x.iterations_a_solve() < y.iterations_a_solve();
        });
    const double apart = greatest->iterations_a_solve() - fewest->iterations_a_solve();
    good &= judge("iterations a linear solve: largest difference between ranks", apart, "<= 2",
                  apart <= 2);
    return good;
}

/// A pressed beam, corotated and static, solved from zero to 1e-8 on one rank, two and more, and at
/// a fixed size a rank; the same by other preconditioners; seconds by phase, memory, messages; and
/// a model of 10^3 to 10^5 ranks fitted to these. Returns 1 if a target is missed. Starts `livetet
/// solve` by the launcher, so it must not run under mpirun itself.
int bench_scaling(const ScalingArguments& a) {
    if (a.ranks.empty() || *std::min_element(a.ranks.begin(), a.ranks.end()) < 1)
        fail("--ranks: expected numbers from 1 on");
    for (const std::string& kind : a.others) (void)solver_of(kind);
    const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    const double of_one = measure_bandwidth(1), of_all = measure_bandwidth(cores);
    fmt::print("memory bandwidth: {:.1f} GB/s on one core, {:.1f} on {}\n", of_one / 1e9,
               of_all / 1e9, cores);
    const ScalingRuns measured = measure_runs(a, cores);
    const std::vector<SolveRun> all = measured.all();
    print_runs(all);
    fmt::print("\n");
    const bool good = judge_runs(measured, cores, of_all / of_one);
    const ScalingModel model(measured.weak.empty() ? measured.strong.front()
                                                   : measured.weak.back());
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
                     "numbers of ranks; times of runs with more ranks than this machine has cores "
                     "are printed but not judged")
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
