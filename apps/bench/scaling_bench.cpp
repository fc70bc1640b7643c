#include "apps/bench/scaling_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "apps/bench/beam_mesh.hpp"
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

/// The edge of a beam's mesh with so many unknowns after being refined. A tet has about 0.2 e^3 of
/// volume, a node 5.75 tets.
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
    return solver_at_its_best(kind) + ", relative_tolerance: 1.0e-3";
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
            r.linearisations, r.iterations_a_solve(), r.bytes_an_unknown() / 1e3, r.messages,
            r.message_bytes / 1e6, r.reductions, r.converged ? "" : "  NOT converged");
}

/// One line for a target, and whether it holds.
bool judge(const std::string& what, double value, const std::string& asked, bool holds) {
    fmt::print("{:<70} {:>8.2f}   asked {:<14} {}\n", what, value, asked,
               holds ? "holds" : "MISSED");
    return holds;
}

}  // namespace

int bench_scaling(const ScalingArguments& a) {
    if (a.ranks.empty() || *std::min_element(a.ranks.begin(), a.ranks.end()) < 1)
        fail("--ranks: expected numbers from 1 on");
    for (const std::string& kind : a.others) (void)solver_of(kind);
    const WorkFolder folder(a.folder);
    const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    const double of_one = measure_bandwidth(1), of_all = measure_bandwidth(cores);
    fmt::print("memory bandwidth: {:.1f} GB/s by one core, {:.1f} by {}\n", of_one / 1e9,
               of_all / 1e9, cores);
    std::optional<ProgressLine> progress;
    progress.emplace("scaling");
    const auto mesh = [&](double unknowns, int refine, const std::string& name) {
        progress->update(0, "mesh of " + name);
        write_hierarchy(folder / (name + ".h5"), mesh_beam(edge_for(unknowns, refine), {}));
    };
    const std::size_t total = 2 * a.ranks.size() + a.others.size();
    std::size_t count = 0;
    const auto run = [&](const std::string& name, const std::string& of_mesh,
                         const std::string& kind, int ranks) {
        const fs::path scene = folder / fmt::format("{}_{}.yaml", of_mesh, kind);
        write_text_file(scene, scene_text(of_mesh + ".h5", a.refine, solver_of(kind),
                                          fmt::format("{}_{}.h5", of_mesh, kind) + ".result.h5"));
        progress->update(static_cast<double>(count++) / static_cast<double>(total),
                         fmt::format("{} on {} ranks", name, ranks));
        return run_solve(name, a.launcher, ranks, scene);
    };

    // 1. strong, weak, others
    mesh(a.unknowns, a.refine, "whole");
    std::vector<SolveRun> strong, weak, others;
    for (const int ranks : a.ranks)
        strong.push_back(run("multigrid, one size", "whole", "multigrid", ranks));
    int most = *std::min_element(a.ranks.begin(),
                                 a.ranks.end());  // of those asked for, what the cores allow
    for (const int ranks : a.ranks)
        if (ranks <= cores) most = std::max(most, ranks);
    for (const int ranks : a.ranks) {
        if (ranks > most) continue;
        const std::string name = fmt::format("weak{}", ranks);
        mesh(a.unknowns * ranks / most, a.refine, name);
        weak.push_back(run("multigrid, one size a rank", name, "multigrid", ranks));
    }
    for (const std::string& kind : a.others)
        others.push_back(run(kind + ", one size", "whole", kind, most));
    progress.reset();

    // 2. told
    std::vector<SolveRun> all = strong;
    all.insert(all.end(), weak.begin(), weak.end());
    all.insert(all.end(), others.begin(), others.end());
    print_runs(all);
    const auto by_ranks = [&](int ranks) {
        return std::find_if(strong.begin(), strong.end(),
                            [&](const SolveRun& r) { return r.ranks == ranks; });
    };
    fmt::print("\n");
    bool good = std::all_of(all.begin(), all.end(), [](const SolveRun& r) { return r.converged; });
    if (!good) fmt::print("a run did not converge: its times are no comparison\n");
    const auto one = by_ranks(1), two = by_ranks(2), ours = by_ranks(most);
    for (const SolveRun& r : others) {
        const double least = r.name.starts_with("gamg") ? 3 : 5;
        good &= judge(fmt::format("{}: times multigrid's time to solution", r.name),
                      r.solution_s() / ours->solution_s(), fmt::format(">= {}", least),
                      r.solution_s() >= least * ours->solution_s());
    }
    double memory = 0;
    for (const SolveRun& r : strong)
        if (r.ranks <= most) memory = std::max(memory, r.bytes_an_unknown() / 1e3);
    good &= judge("kB an unknown at the peak, all ranks together", memory, "<= 1.5", memory <= 1.5);
    if (one != strong.end() && two != strong.end() && cores >= 2) {
        const double faster = one->solution_s() / two->solution_s();
        good &= judge("two ranks: times as fast as one", faster, ">= 1.7", faster >= 1.7);
        fmt::print("{:<70} {:>8.2f}   (two cores read {:.2f} times what one does)\n",
                   "  bound by memory: at most about", of_all / of_one, of_all / of_one);
    }
    const auto [fewest, greatest] =
        std::minmax_element(strong.begin(), strong.end(), [](const SolveRun& x, const SolveRun& y) {
            return x.iterations_a_solve() < y.iterations_a_solve();
        });
    const double apart = greatest->iterations_a_solve() - fewest->iterations_a_solve();
    good &= judge("iterations a linear solve: most apart on different ranks", apart, "<= 2",
                  apart <= 2);
    const ScalingModel model(weak.empty() ? strong.front() : weak.back());
    print(model);

    // 3. the files
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
        const WorkPrecisionChart chart{
            "What an iteration takes at 10^5 unknowns a rank, by the model", "seconds",
            lines_of(model), "ranks"};
        write_work_precision_picture(a.figure, std::span(&chart, 1));
    }
#endif
    return good ? 0 : 1;
}

}  // namespace livetet
