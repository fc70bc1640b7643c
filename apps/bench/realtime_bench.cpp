#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <thread>

#include "apps/bench/beam_mesh.hpp"
#include "apps/bench/benchmarks.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/machine_figures.hpp"
#include "apps/bench/realtime_cases.hpp"
#include "apps/bench/realtime_cut.hpp"
#include "apps/bench/realtime_front.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

/// Throws Error if one of these is no case.
void check_sizes(const std::vector<std::string>& sizes) {
    const std::vector<std::string> known = RealtimeArguments{}.sizes;
    for (const std::string& name : sizes)
        if (std::ranges::find(known, name) == known.end())
            fail("--size {}: no such case, there are {}", name, fmt::join(known, ", "));
}

bool has_own_table(const std::string& size) { return size == "front" || size == "cut"; }

/// Frame rates and errors of the live solver on the phantom and on a beam. Returns 1 if a target is
/// missed.
int bench_realtime(const RealtimeArguments& arguments) {
    PetscSession session("livetet", {});
    if (session.ranks() > 1)
        fail("bench realtime runs on one rank, found {}: start it without mpirun", session.ranks());
    const PhantomSize phantoms[] = {{"P60", 60000, 150, 0.005, 0.02},
                                    {"V68", 360000, 30, 0.01, 0.03}};
    const BeamSize beams[] = {{"beamA", 0.0050, 0.006, 0.006, 2},
                              {"beamB", 0.00272, 0.06, 0.01, 4}};
    const auto requested = [&](const std::string& name) {
        return std::find(arguments.sizes.begin(), arguments.sizes.end(), name) !=
               arguments.sizes.end();
    };
    check_sizes(arguments.sizes);
    if (!arguments.organ.empty() && !requested("front"))
        fail("--organ {}: no case takes it, expected --size front", arguments.organ.string());
    const int threads =
        arguments.threads > 0
            ? arguments.threads
            : std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 4);
    const MachineFigures machine = measure_machine(threads);
    print_machine(machine);
    if (arguments.frames > 0 && !std::ranges::all_of(arguments.sizes, has_own_table))
        print_realtime_header();
    std::vector<RealtimeResult> results;
    std::vector<WorkPrecisionChart> charts;
    ProgressLine progress("realtime");
    const auto keep = [&](RealtimeResult result) {
        print_row(result);
        results.push_back(std::move(result));
    };
    for (const PhantomSize& size : phantoms) {
        if (!requested(size.name)) continue;
        const MeshHierarchy hierarchy =
            mesh_phantom(make_phantom_images(0.0015, 1), size, progress.callback());
        if (arguments.frames > 0)
            for (const double nu : {0.45, 0.49})
                for (const TimeScheme scheme :
                     {TimeScheme::static_equilibrium, TimeScheme::newmark})
                    keep(measure_phantom(size, hierarchy, nu, scheme, arguments,
                                         machine.bandwidth(), progress));
        if (!arguments.figure.empty() && charts.empty())
            charts.push_back(measure_methods(size, hierarchy, arguments.threads, progress));
    }
    for (const BeamSize& size : beams)
        if (requested(size.name) && arguments.frames > 0)
            keep(measure_beam(size, mesh_beam(size.edge_m, progress.callback()), arguments,
                              machine.bandwidth(), progress));
    nlohmann::json front;
    if (requested("front") && arguments.frames > 0) {
        const Front measured =
            measure_front({std::max(arguments.frames, 60), std::clamp(arguments.frames, 60, 180),
                           arguments.truth_tets, arguments.threads, arguments.poisson,
                           arguments.organ, arguments.label},
                          progress);
        print_front(measured);
        front = {{"name", "front"}, {"organ", measured.organ}, {"rows", json_of(measured.rows)}};
        charts.push_back(chart_of(measured));
    }
    bool all = true;
    nlohmann::json cuts;
    if (requested("cut") && arguments.frames > 0) {
        const std::vector<CutRow> rows =
            measure_cuts(std::min(arguments.frames, 1000), arguments.threads, progress);
        print_cuts(rows);
        cuts = json_of(rows);
        all = std::ranges::all_of(rows, &CutRow::meets_target);
    }
    nlohmann::json list = nlohmann::json::array();
    for (const RealtimeResult& r : results) {
        list.push_back(json_of(r));
        all = all && r.meets_target();
    }
    if (!front.is_null()) list.push_back(front);
    if (!cuts.is_null()) list.push_back({{"name", "cut"}, {"rows", cuts}});
    list.push_back({{"name", "machine"}, {"figures", json_of(machine)}});
    if (!arguments.json.empty()) write_text_file(arguments.json, list.dump(2) + "\n");
    if (!charts.empty() && !arguments.figure.empty())
        write_work_precision_picture(arguments.figure, charts);
    return all ? 0 : 1;
}

}  // namespace

void add_realtime_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "realtime",
        "Frame rate of the live solver and distance of each frame from the converged one; exit "
        "status 1 if a target is missed");
    auto a = std::make_shared<RealtimeArguments>();
    command->add_option("--size", a->sizes,
                        "cases: P60, V68 (the phantom), beamA, beamB, front (whole error "
                        "against frame time, by elements and law), cut (frames while a blade cuts, "
                        "some 1000 of each row at most, in real time); default: all");
    command
        ->add_option(
            "--frames", a->frames,
            "timed frames of each case, and of each row of front; 0: none, for --figure alone")
        ->capture_default_str()
        ->check(CLI::Range(0, 1000000));
    command
        ->add_option("--threads", a->threads,
                     "0: one a core, at most 4 and at most one for each 500 nodes")
        ->capture_default_str()
        ->check(CLI::Range(0, 64));
    command->add_option("--truth-tets", a->truth_tets, "ten-node tets of the true organ of front")
        ->capture_default_str()
        ->check(CLI::Range(500, 1000000));
    command->add_option("--poisson", a->poisson, "Poisson's ratio of front, of body and truth")
        ->capture_default_str()
        ->check(CLI::Range(0.3, 0.4999));
    command->add_option("--organ", a->organ,
                        "organ of front: a label map, or a closed surface in mm (RAS); pressed at "
                        "its front, held at its back (default: the phantom)");
    command->add_option("--label", a->label, "of the organ in its label map; 0: all")
        ->capture_default_str()
        ->check(CLI::Range(0, 1000000));
    command->add_option("--json", a->json, "write the figures of every case to this file");
    add_figure_option(*command, "--figure", a->figure,
                      "draw error against frame time for each method, on the mesh of the first "
                      "phantom case, to this PNG");
    command->callback([a, &status] {
        check_output_files({a->json});
        check_figures({a->figure});
        status = bench_realtime(*a);
    });
}

}  // namespace livetet
