#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/bench/benchmarks.hpp"
#include "apps/bench/convergence_report.hpp"
#include "apps/bench/figure_option.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"

namespace livetet {

namespace {

/// Iterations and time of one linear solve to 1e-8 of a clamped and pressed beam, by each
/// preconditioner, against mesh size, Poisson's ratio, contrast, anisotropy, levels and smoothing
/// steps; and of bodies that are not blocks. Returns 1 if multigrid's iterations grow by more than
/// a fifth from 10^4 nodes on, or if `judge_bodies` is false.
int bench_convergence(const ConvergenceArguments& a) {
    const WorkFolder folder(a.folder);
    ConvergenceScenes scenes(folder, a.nodes);
    const auto all = convergence_solves(a);
    std::vector<ConvergencePoint> points;
    {
        ProgressLine progress("convergence");
        for (std::size_t k = 0; k < all.size(); ++k) {
            const auto& [setting, method] = all[k];
            progress.update(
                static_cast<double>(k) / static_cast<double>(all.size()),
                fmt::format("{} {}, {}", setting.against, setting.value_text(), method.name));
            points.push_back(scenes.solve(setting, method));
        }
    }
    print_convergence(points);
    fmt::print(
        "\ncut: number of uniform refinements that made the finest mesh; the levels below are each "
        "meshed on their own (above {:.0e} nodes\n"
        "Gmsh takes minutes); BoomerAMG, GAMG, ICC, Jacobi and Galerkin stop where they would take "
        "minutes\n",
        max_meshed_nodes);
    const bool grows_little = judge_growth(points), bodies_hold = judge_bodies(points);
    if (!a.csv.empty()) write_text_file(a.csv, convergence_csv(points));
    if (!a.json.empty()) write_text_file(a.json, convergence_json(points).dump(2) + "\n");
#ifdef LIVETET_IMAGES
    if (!a.figure.empty()) draw_convergence(a.figure, points);
#endif
    return grows_little && bodies_hold ? 0 : 1;
}

}  // namespace

void add_convergence_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "convergence",
        "Iterations and time to 1e-8 of each preconditioner against mesh size, Poisson's ratio, "
        "contrast, anisotropy, levels and smoothing steps, and on bodies that are not blocks; exit "
        "status 1 if multigrid's iterations grow by more than a fifth, or if `automatic` takes "
        "more than 40 on the organ or, on one level, twice the quickest other's time");
    auto a = std::make_shared<ConvergenceArguments>();
    command->add_option("--min-nodes", a->min_nodes, "nodes of the smallest mesh")
        ->capture_default_str()
        ->check(CLI::Range(300., 1e9));
    command->add_option("--max-nodes", a->max_nodes, "nodes of the largest mesh")
        ->capture_default_str()
        ->check(CLI::Range(1e3, 1e9));
    command
        ->add_option("--nodes", a->nodes,
                     "nodes of the mesh on which everything but mesh size is varied")
        ->capture_default_str()
        ->check(CLI::Range(300., 1e9));
    command->add_option("--only", a->only,
                        "only solves with this in their name, such as \"nodes\" or \"nu, "
                        "multigrid\"");
    command->add_option("--folder", a->folder, "keep meshes, scenes and logs here");
    command->add_option("--csv", a->csv, "write all figures to this file");
    command->add_option("--json", a->json, "the same as JSON");
    add_figure_option(*command, "--figure", a->figure,
                      "draw iterations and time against mesh size to this PNG");
    command->callback([a, &status] {
        check_output_files({a->csv, a->json});
        check_figures({a->figure});
        status = bench_convergence(*a);
    });
}

}  // namespace livetet
