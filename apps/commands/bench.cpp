#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/bench/convergence_bench.hpp"
#include "apps/bench/savings_bench.hpp"
#include "apps/bench/scaling_bench.hpp"
#include "apps/bench/stability_bench.hpp"
#include "apps/bench/workprecision_bench.hpp"
#include "apps/commands/commands.hpp"
#include "apps/verification/suite.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"
#include "solvers/parallel/petsc_session.hpp"
#ifdef LIVETET_IMAGES
#include "apps/bench/accuracy_bench.hpp"
#include "apps/bench/latency_bench.hpp"
#include "apps/bench/realtime_bench.hpp"
#include "apps/bench/view_bench.hpp"
#include "apps/bench/warp_bench.hpp"
#include "apps/plots/pictures.hpp"
#include "apps/plots/virtual_display.hpp"
#endif

namespace livetet {

namespace {

using nlohmann::json;
using verification::Case;
using verification::Outcome;

struct VerificationArguments {
    std::string only;
    std::filesystem::path csv, json, figure;
};

std::string order_text(const Outcome& o) {
    return o.expected_order > 0 ? fmt::format("{:.2f}", o.observed_order()) : std::string("-");
}

double total_seconds(const Outcome& o) {
    double seconds = 0;
    for (const auto& run : o.runs) seconds += run.seconds;
    return seconds;
}

std::string csv_text(const std::vector<Outcome>& outcomes) {
    std::string text =
        "case,source,unit,reference,size,value,error,tolerance,order,expected_order,seconds,"
        "passed\n";
    for (const Outcome& o : outcomes)
        for (const auto& run : o.runs) {
            const bool last = &run == &o.runs.back();
            text += fmt::format(
                "\"{}\",\"{}\",{},{:.9g},\"{}\",{:.9g},{:.3e},{},{},{},{:.3f},{}\n", o.name,
                o.source, o.unit, o.reference, run.size, run.value, run.error,
                last ? fmt::format("{:.1e}", o.tolerance) : "", last ? order_text(o) : "",
                last && o.expected_order > 0 ? fmt::format("{}", o.expected_order) : "",
                run.seconds, last ? (o.passed() ? "yes" : "no") : "");
        }
    return text;
}

json json_of(const std::vector<Outcome>& outcomes) {
    json list = json::array();
    for (const Outcome& o : outcomes) {
        json runs = json::array();
        for (const auto& run : o.runs)
            runs.push_back({{"size", run.size},
                            {"value", run.value},
                            {"error", run.error},
                            {"seconds", run.seconds}});
        list.push_back({{"case", o.name},
                        {"source", o.source},
                        {"unit", o.unit},
                        {"reference", o.reference},
                        {"tolerance", o.tolerance},
                        {"expected_order", o.expected_order},
                        {"observed_order", o.observed_order()},
                        {"passed", o.passed()},
                        {"runs", runs}});
    }
    return list;
}

#ifdef LIVETET_IMAGES
/// Error against time of the cases with a sequence of meshes: what P2 buys, and what pressures do.
void draw(const std::filesystem::path& path, const std::vector<Outcome>& outcomes) {
    const auto chart = [&](const std::string& title, const std::string& error,
                           const std::string& begin, const std::string& end) {
        WorkPrecisionChart c{title, error, {}};
        for (const Outcome& o : outcomes) {
            if (!o.name.starts_with(begin) || !o.name.ends_with(end)) continue;
            WorkPrecisionLine line{
                o.name.substr(begin.size(), o.name.size() - begin.size() - end.size()), {}, {}};
            for (const auto& run : o.runs) {
                line.seconds.push_back(std::max(run.seconds, 1e-3));
                line.error.push_back(run.error);
            }
            c.lines.push_back(std::move(line));
        }
        if (c.lines.empty())
            fail("--figure draws the order study and the thick cylinder, --only left them out");
        return c;
    };
    const WorkPrecisionChart charts[] = {
        chart("A smooth field", "relative error of u, L2", "manufactured field, ", ": u in L2"),
        chart("A thick cylinder, nu = 0.4999", "relative error of u at the inner face",
              "thick cylinder, nu = 0.4999, linear ", ": u_r(a)")};
    write_work_precision_picture(path, charts);
}
#endif

int verify(const VerificationArguments& arguments) {
    PetscSession session("livetet", {});
    if (session.ranks() > 1) fail("bench verification runs on one rank, found {}", session.ranks());
    std::vector<const Case*> chosen;
    std::vector<std::string> names;
    for (const Case& c : verification::cases()) {
        names.push_back(c.name);
        if (c.name.find(arguments.only) != std::string::npos) chosen.push_back(&c);
    }
    if (chosen.empty())
        fail("--only {}: no case has that in its name, there are: {}", arguments.only,
             fmt::join(names, ", "));
    std::vector<Outcome> outcomes;
    {
        ProgressLine progress("verification");
        for (std::size_t i = 0; i < chosen.size(); ++i) {
            progress.update(static_cast<double>(i) / chosen.size(), chosen[i]->name);
            for (Outcome& o : chosen[i]->run()) outcomes.push_back(std::move(o));
        }
    }
    fmt::print("{:<74} {:>12} {:>12} {:>9} {:>9} {:>6} {:>7}  {}\n", "case", "reference", "ours",
               "error", "allowed", "order", "s", "source");
    int failed = 0;
    for (const Outcome& o : outcomes) {
        fmt::print("{:<74} {:>12.6g} {:>12.6g} {:>9.1e} {:>9} {:>6} {:>7.1f}  {}{}\n", o.name,
                   o.reference, o.last().value, o.last().error,
                   o.tolerance > 0 ? fmt::format("{:.0e}", o.tolerance) : "-", order_text(o),
                   total_seconds(o), o.source,
                   o.passed() ? "" : "  <-- NOT within its tolerance or order");
        failed += !o.passed();
    }
    const auto judged = std::count_if(outcomes.begin(), outcomes.end(),
                                      [](const Outcome& o) { return o.tolerance > 0; });
    fmt::print("\n{} of {} within their tolerances and orders ({} told, not judged)\n",
               judged - failed, judged, outcomes.size() - judged);
    if (!arguments.csv.empty()) write_text_file(arguments.csv, csv_text(outcomes));
    if (!arguments.json.empty()) write_text_file(arguments.json, json_of(outcomes).dump(2) + "\n");
#ifdef LIVETET_IMAGES
    if (!arguments.figure.empty()) draw(arguments.figure, outcomes);
#endif
    return failed ? 1 : 0;
}

/// What `run` says, which takes minutes: that its figure can be drawn is seen to before.
template <class Run>
int with_display([[maybe_unused]] const std::filesystem::path& figure, Run&& run) {
#ifdef LIVETET_IMAGES
    if (!figure.empty()) need_display(figure.string());
#endif
    return run();
}

}  // namespace

void add_bench_command(CLI::App& app, ExitStatus& status) {
    CLI::App* bench =
        app.add_subcommand("bench", "Measures: what the README's figures are made with");
    bench->require_subcommand(1);
    CLI::App* command = bench->add_subcommand("verification",
                                              "Every case with its published or closed-form value: "
                                              "reference, ours, error, observed order");
    auto arguments = std::make_shared<VerificationArguments>();
    command->add_option("--only", arguments->only, "only the cases with this in their name");
    command->add_option("--csv", arguments->csv, "write every run of every case to this file");
    command->add_option("--json", arguments->json, "the same as JSON");
#ifdef LIVETET_IMAGES
    command->add_option("--figure", arguments->figure, "draw error against time to this PNG");
#endif
    command->callback([arguments, &status] {
        status.value = with_display(arguments->figure, [&] { return verify(*arguments); });
    });
    CLI::App* scaling =
        bench->add_subcommand("scaling",
                              "Strong and weak scaling of a pressed beam under mpirun, by phase, "
                              "against GAMG and BoomerAMG, and a model of 10^3 to 10^5 "
                              "ranks; exit 1 where a target is missed");
    auto scaled = std::make_shared<ScalingArguments>();
    scaling
        ->add_option(
            "--ranks", scaled->ranks,
            "numbers of ranks; those beyond this machine's cores are told, not judged for time")
        ->delimiter(',')
        ->capture_default_str();
    scaling->add_option("--unknowns", scaled->unknowns, "about how many")
        ->capture_default_str()
        ->check(CLI::Range(1e3, 1e10));
    scaling->add_option("--refine", scaled->refine, "how often the mesh is cut, tet into eight")
        ->capture_default_str()
        ->check(CLI::Range(0, 4));
    scaling->add_option("--compare", scaled->others, "gamg, boomeramg")
        ->delimiter(',')
        ->capture_default_str();
    scaling
        ->add_option("--launcher", scaled->launcher,
                     "what starts a run, {} the number of ranks: srun -n {}")
        ->capture_default_str();
    scaling->add_option("--folder", scaled->folder, "keep meshes, scenes, logs and results here");
    scaling->add_option("--json", scaled->json, "write every figure to this file");
#ifdef LIVETET_IMAGES
    scaling->add_option("--figure", scaled->figure, "draw the model to this PNG");
#endif
    scaling->callback([scaled, &status] {
        status.value = with_display(scaled->figure, [&] { return bench_scaling(*scaled); });
    });
    CLI::App* choices =
        bench->add_subcommand("workprecision",
                              "Error against run time and memory of one scene over the choices "
                              "that matter, against ten-node tets on its "
                              "finest mesh; ends with what to choose");
    auto chosen = std::make_shared<WorkPrecisionArguments>();
    choices->add_option("scene", chosen->scene, "scene file (YAML)")->required();
    choices
        ->add_option("--repeats", chosen->repeats,
                     "rounds that times are medians of; choices that take over 5 s are run once")
        ->capture_default_str()
        ->check(CLI::Range(1, 100));
    choices->add_option("--only", chosen->only,
                        "only choices with this in their name, as \"solver\" or \"level 1, P2\"");
    choices->add_option("--folder", chosen->folder, "keep meshes, scenes and logs here");
    choices->add_option("--csv", chosen->csv, "write every choice's figures to this file");
    choices->add_option("--json", chosen->json, "the same as JSON");
#ifdef LIVETET_IMAGES
    choices->add_option("--figure", chosen->figure, "draw error against run time to this PNG");
    choices->add_option("--memory-figure", chosen->memory_figure,
                        "draw error against memory to this PNG");
#endif
    choices->callback([chosen, &status] {
        status.value = with_display(chosen->figure.empty() ? chosen->memory_figure : chosen->figure,
                                    [&] { return bench_workprecision(*chosen); });
    });
    CLI::App* convergence = bench->add_subcommand(
        "convergence",
        "Iterations and time to 1e-8 of each preconditioner against mesh size, nu, contrast, "
        "anisotropy, levels and "
        "smoothing steps; exit 1 where multigrid's iterations grow by more than a fifth");
    auto converged = std::make_shared<ConvergenceArguments>();
    convergence->add_option("--least-nodes", converged->least_nodes, "of the smallest mesh")
        ->capture_default_str()
        ->check(CLI::Range(300., 1e9));
    convergence->add_option("--most-nodes", converged->most_nodes, "of the largest mesh")
        ->capture_default_str()
        ->check(CLI::Range(1e3, 1e9));
    convergence
        ->add_option("--nodes", converged->nodes, "of the mesh on which all but its size is varied")
        ->capture_default_str()
        ->check(CLI::Range(300., 1e9));
    convergence->add_option(
        "--only", converged->only,
        "only solves with this in their name, as \"nodes\" or \"nu, multigrid\"");
    convergence->add_option("--folder", converged->folder, "keep meshes, scenes and logs here");
    convergence->add_option("--csv", converged->csv, "write every figure to this file");
    convergence->add_option("--json", converged->json, "the same as JSON");
#ifdef LIVETET_IMAGES
    convergence->add_option("--figure", converged->figure,
                            "draw iterations and time against mesh size to this PNG");
#endif
    convergence->callback([converged, &status] {
        status.value =
            with_display(converged->figure, [&] { return bench_convergence(*converged); });
    });
    CLI::App* savings = bench->add_subcommand("savings",
                                              "What a scene saves by what it leaves out: as it is, "
                                              "and with each part forced on that it does not need");
    auto saved = std::make_shared<SavingsArguments>();
    savings->add_option("scene", saved->scene, "scene file (YAML)")->required();
    savings->add_option("--repeats", saved->repeats, "rounds that times are medians of")
        ->capture_default_str()
        ->check(CLI::Range(1, 100));
    savings->add_option("--folder", saved->folder, "keep mesh, scenes, logs and results here");
    savings->add_option("--json", saved->json, "write every figure to this file");
    savings->callback([saved, &status] { status.value = bench_savings(*saved); });
    CLI::App* stability =
        bench->add_subcommand("stability",
                              "Stiff and extreme cases in every strain model and scheme, as solve "
                              "and as track step them, judged by rule; exit 1 "
                              "where one fails that is not a known limit");
    auto stable = std::make_shared<StabilityArguments>();
    stability->add_option("--cells", stable->cells, "along the height of the box that is tried")
        ->capture_default_str()
        ->check(CLI::Range(2, 64));
    stability
        ->add_option("--noise-frames", stable->noise_frames,
                     "of a sensor's noise, on 96 tets; a thousandth of them as solve steps")
        ->capture_default_str()
        ->check(CLI::Range(1000, 1000000000));
    stability->add_option("--budget", stable->budget_ms, "ms that a frame of track may take")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    stability->add_option("--only", stable->only,
                          "only cases with this in their name, as \"time step\"");
    stability->add_option("--column", stable->column,
                          "only columns with this in their name, as \"track, green, newmark\"");
    stability->add_option("--csv", stable->csv, "write every cell to this file");
    stability->add_option("--json", stable->json, "the same as JSON");
#ifdef LIVETET_IMAGES
    stability->add_option("--figure", stable->figure, "draw the matrix to this PNG");
#endif
    stability->callback([stable, &status] {
        status.value = with_display(stable->figure, [&] { return bench_stability(*stable); });
    });
#ifdef LIVETET_IMAGES
    CLI::App* realtime =
        bench->add_subcommand("realtime",
                              "Frames a second of the live solver and how far each is from the "
                              "converged one; exit 1 where a target is missed");
    auto live = std::make_shared<RealtimeArguments>();
    realtime->add_option("--size", live->sizes,
                         "the cases: P60, V68 (the phantom), beamA, beamB; default: all");
    realtime
        ->add_option("--frames", live->frames,
                     "timed frames of each phantom case; 0: none, for --figure alone")
        ->capture_default_str()
        ->check(CLI::Range(0, 1000000));
    realtime
        ->add_option("--threads", live->threads, "0: one a core, 4 at most, one for each 500 nodes")
        ->capture_default_str()
        ->check(CLI::Range(0, 64));
    realtime->add_option("--json", live->json, "write every case's figures to this file");
    realtime->add_option("--figure", live->figure,
                         "draw error against frame time, method by method, on the first phantom's "
                         "mesh asked for, to this PNG");
    realtime->callback([live, &status] {
        status.value = with_display(live->figure, [&] { return bench_realtime(*live); });
    });
    CLI::App* latency =
        bench->add_subcommand("latency",
                              "From a tracker's message to the published frame that used it, over "
                              "TCP; exit 1 where a target is missed");
    auto late = std::make_shared<LatencyArguments>();
    latency->add_option("--for", late->seconds, "seconds that are measured")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    latency->add_option("--rate", late->rate_Hz, "samples a second")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    latency->add_option("--tets", late->tets, "of the phantom's finest mesh")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    latency->add_option("--budget", late->budget_ms, "ms that a frame may take")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    latency->add_option("--json", late->json, "write the figures to this file");
    latency->callback([late, &status] { status.value = bench_latency(*late); });
    CLI::App* view =
        bench->add_subcommand("view",
                              "Pictures a second of the window beside a run, and what it costs the "
                              "simulation; exit 1 where the target is missed");
    auto viewed = std::make_shared<ViewBenchArguments>();
    view->add_option("--for", viewed->seconds,
                     "seconds of each stretch, with the window and without")
        ->capture_default_str()
        ->check(CLI::Range(1.0, 1000.0));
    view->add_option("--stretches", viewed->stretches, "of each")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    view->add_option("--rate", viewed->rate_Hz, "samples a second")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    view->add_option("--budget", viewed->budget_ms, "ms that a frame may take")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    view->add_option("--tets", viewed->tets, "of the phantom's finest mesh")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    view->add_option("--json", viewed->json, "write the figures to this file");
    view->callback([viewed, &status] {
        need_display("bench view");
        status.value = bench_view(*viewed);
    });
    CLI::App* accuracy =
        bench->add_subcommand("accuracy",
                              "Error at targets inside the pressed phantom, rigid-only against "
                              "deforming, and what limits it; exit 1 where "
                              "rigid-only is better");
    auto experiment = std::make_shared<AccuracyArguments>();
    accuracy->add_option("--seeds", experiment->seeds, "runs of each cell")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000));
    accuracy->add_option("--tets", experiment->tets, "of the model")
        ->capture_default_str()
        ->check(CLI::Range(500, 1000000));
    accuracy
        ->add_option("--truth-tets", experiment->truth_tets, "of the truth, with ten nodes each")
        ->capture_default_str()
        ->check(CLI::Range(500, 1000000));
    accuracy->add_option("--json", experiment->json, "write every cell's errors to this file");
    accuracy->add_option("--csv", experiment->csv, "write every run's errors to this file");
    accuracy->add_option("--figure", experiment->figure,
                         "draw errors with their spread against the press to this PNG");
    accuracy->callback([experiment, &status] {
        status.value =
            with_display(experiment->figure, [&] { return bench_accuracy(*experiment); });
    });
    CLI::App* warp = bench->add_subcommand("warp",
                                           "The image in the deformed state, part by part, against "
                                           "VTK's probe filter; exit 1 where a target is missed");
    auto warped = std::make_shared<WarpBenchArguments>();
    warp->add_option("--size", warped->size, "voxels along each axis")
        ->capture_default_str()
        ->check(CLI::Range(16, 1024));
    warp->add_option("--tets", warped->tets, "of the phantom's mesh")
        ->capture_default_str()
        ->check(CLI::Range(500, 1000000));
    warp->add_option("--repeats", warped->repeats, "runs that times are medians of")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    warp->add_option("--json", warped->json, "write the figures to this file");
    warp->callback([warped, &status] { status.value = bench_warp(*warped); });
#endif
}

}  // namespace livetet
