#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/bench/benchmarks.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/registration_run.hpp"
#include "apps/plots/pictures.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

struct RegistrationBenchArguments {
    int seeds = 8;
    int tets = 6000, truth_tets = 4000, timed_tets = 20000;
    bool quick = false;
    RegistrationPrior prior;
    std::string only;
    std::filesystem::path surface, json, figure;
};

/// A cell, and its runs by seed.
struct MeasuredCell {
    RegistrationCell cell;
    std::vector<RegistrationRun> runs{};

    double rigid() const { return rms_over(runs, &RegisteredTarget::rigid); }
    double deforming() const { return rms_over(runs, &RegisteredTarget::deforming); }
};

/// The first is the one that the others differ from in one condition; the last has all that is bad.
std::vector<MeasuredCell> registration_cells(const RegistrationBenchArguments& a) {
    std::vector<MeasuredCell> cells{{}};
    if (a.quick) return cells;
    const auto add = [&](const char* varied, auto&& change) {
        if (!a.only.empty() && a.only != varied) return;
        MeasuredCell& added = cells.emplace_back();
        added.cell.varied = varied;
        change(added.cell);
    };
    for (const double coverage : {0.1, 0.2, 0.6, 1.0})
        add("coverage", [&](RegistrationCell& c) { c.sweep.coverage = coverage; });
    for (const double noise : {0.0, 0.002, 0.003})
        add("noise", [&](RegistrationCell& c) { c.sweep.noise_m = noise; });
    for (const double outliers : {0.1, 0.2})
        add("outliers", [&](RegistrationCell& c) { c.sweep.outliers = outliers; });
    for (const double rms : {0.0025, 0.005, 0.010})
        add("motion", [&](RegistrationCell& c) { c.rms_m = rms; });
    add("support", [&](RegistrationCell& c) { c.support = KnownSupport::soft; });
    add("law", [&](RegistrationCell& c) { c.law = "corotated"; });
    add("zone", [&](RegistrationCell& c) { c.forces = KnownForces::wide_zone; });
    add("forces", [&](RegistrationCell& c) { c.forces = KnownForces::nowhere; });
    add("all", [&](RegistrationCell& c) {
        c = {"all",      0.005, {0.1, 0.003, 0.2}, KnownSupport::soft, KnownForces::nowhere,
             "corotated"};
    });
    return cells;
}

void print_cells(const std::vector<MeasuredCell>& cells, const RegistrationBenchArguments& a) {
    fmt::print(
        "{:>9} {:>6} {:>8} {:>9} {:>8} {:>7} {:>8} {:>9} {:>5} {:>8} {:>9} {:>6} {:>6} {:>6}\n",
        "varied", "seen/%", "noise/mm", "outlier/%", "moved/mm", "most/mm", "rigid/mm", "deform/mm",
        "ratio", "within/%", "radius/mm", "open/%", "failed", "fit/s");
    for (const MeasuredCell& m : cells) {
        double largest = 0, fit_s = 0, within = 0, radius2 = 0, stated = 0, failed = 0, open = 0,
               directions = 0;
        for (const RegistrationRun& run : m.runs) {
            largest = std::max(largest, run.largest_m);
            fit_s += run.fit_s / static_cast<double>(m.runs.size());
            failed += !run.converged;
            if (!run.is_stated) continue;
            open += static_cast<double>(run.open_directions);
            directions += static_cast<double>(run.directions);
            for (const RegisteredTarget& t : run.targets) {
                within += t.within;
                radius2 += t.radius_95 * t.radius_95;
                ++stated;
            }
        }
        const RegistrationCell& c = m.cell;
        fmt::print(
            "{:>9} {:>6.0f} {:>8.1f} {:>9.0f} {:>8.1f} {:>7.1f} {:>8.2f} {:>9.2f} {:>5.1f} "
            "{:>8.0f} "
            "{:>9.2f} {:>6.0f} {:>6} {:>6.2f}\n",
            *c.varied ? c.varied : "none", 100 * c.sweep.coverage, 1e3 * c.sweep.noise_m,
            100 * c.sweep.outliers, 1e3 * rms_over(m.runs, &RegisteredTarget::motion),
            1e3 * largest, 1e3 * m.rigid(), 1e3 * m.deforming(), m.rigid() / m.deforming(),
            100 * within / stated, 1e3 * std::sqrt(radius2 / stated), 100 * open / directions,
            failed, fit_s);
    }
    fmt::print(
        "\nRMS over {} seeds and all targets; within: share of the errors in their stated 95 % "
        "ellipsoid; radius: stated, 95 %; open: directions of the forces left to the prior; "
        "failed: did not converge; fit: processor time. support: soft springs on the lower side "
        "for the true fixed "
        "nodes; law: a corotated model; zone: forces within 40 mm of a place 10 mm off, for 30 and "
        "5; "
        "forces: where they act is not stated; all: these, at once with the rest. A model of about "
        "{} tets, neo-Hookean with nu = 0.40, against a truth of about {} with ten nodes and nu = "
        "0.45\n",
        a.seeds, a.tets, a.truth_tets);
    for (const MeasuredCell& m : cells)
        for (std::size_t s = 0; s < m.runs.size(); ++s)
            if (!m.runs[s].refusal.empty())
                fmt::print("refused: {}, seed {}: {}\n", *m.cell.varied ? m.cell.varied : "none",
                           s + 1, m.runs[s].refusal);
}

/// Prints whether each aim is met. Returns whether all are.
bool judge_registration(const std::vector<MeasuredCell>& cells, const RegistrationRun* timed) {
    bool holds = true;
    const auto aim = [&](bool is_met, const std::string& text) {
        fmt::print("target: {}: {}\n", text, is_met ? "holds" : "MISSED");
        holds &= is_met;
    };
    const MeasuredCell& first = cells.front();
    aim(first.deforming() < 0.003,
        fmt::format("first row within 3 mm: {:.2f} mm", 1e3 * first.deforming()));
    aim(first.deforming() < first.rigid() / 2.5,
        fmt::format("first row 2.5 times better than rigid: {:.1f} times",
                    first.rigid() / first.deforming()));
    std::size_t worse = 0, worse_runs = 0;
    for (const MeasuredCell& m : cells) {
        worse += m.deforming() > m.rigid();
        for (const RegistrationRun& run : m.runs)
            worse_runs += rms_over({run}, &RegisteredTarget::deforming) >
                          rms_over({run}, &RegisteredTarget::rigid);
    }
    aim(worse == 0,
        fmt::format("never worse than rigid: worse in {} rows, in {} runs", worse, worse_runs));
    if (timed) {
        aim(timed->first_s < 1,
            fmt::format("first step within 1 s of processor time on about 20,000 tets: {:.2f} s",
                        timed->first_s));
        aim(timed->fit_s < 10 && timed->converged,
            fmt::format("converged within 10 s of processor time: {:.1f} s{}", timed->fit_s,
                        timed->converged ? "" : ", not converged"));
    }
    return holds;
}

nlohmann::json json_of(const MeasuredCell& m) {
    nlohmann::json rows = nlohmann::json::array();
    for (std::size_t s = 0; s < m.runs.size(); ++s) {
        const RegistrationRun& r = m.runs[s];
        std::size_t within = 0;
        nlohmann::json errors = nlohmann::json::array();
        for (const RegisteredTarget& t : r.targets) {
            within += t.within;
            errors.push_back({1e3 * t.motion.norm(), 1e3 * t.rigid.norm(), 1e3 * t.deforming.norm(),
                              1e3 * t.radius_95});
        }
        rows.push_back({{"varied", m.cell.varied},
                        {"coverage", m.cell.sweep.coverage},
                        {"noise_mm", 1e3 * m.cell.sweep.noise_m},
                        {"outliers", m.cell.sweep.outliers},
                        {"seed", s + 1},
                        {"targets_moved_mm", 1e3 * rms_over({r}, &RegisteredTarget::motion)},
                        {"largest_mm", 1e3 * r.largest_m},
                        {"rigid_mm", 1e3 * rms_over({r}, &RegisteredTarget::rigid)},
                        {"deforming_mm", 1e3 * rms_over({r}, &RegisteredTarget::deforming)},
                        {"motion_rigid_deforming_radius_mm", errors},
                        {"within_95", within},
                        {"stated", r.is_stated},
                        {"converged", r.converged},
                        {"reason", r.reason},
                        {"refusal", r.refusal},
                        {"iterations", r.iterations},
                        {"energy_mJ", r.energy_mJ},
                        {"first_step_s", r.first_s},
                        {"fit_s", r.fit_s}});
    }
    return rows;
}

double varied_value(const RegistrationCell& c, std::string_view varied) {
    if (varied == "coverage") return 100 * c.sweep.coverage;
    if (varied == "noise") return 1e3 * c.sweep.noise_m;
    if (varied == "outliers") return 100 * c.sweep.outliers;
    return 1e3 * c.rms_m;
}

/// Errors against each quantity that was varied, with the first cell's among them.
void draw_registration(const std::filesystem::path& path, const std::vector<MeasuredCell>& cells) {
    const std::pair<const char*, const char*> axes[] = {{"coverage", "surface seen [%]"},
                                                        {"noise", "noise [mm]"},
                                                        {"outliers", "outliers [%]"},
                                                        {"motion", "motion of the targets [mm]"}};
    std::vector<SpreadChart> charts;
    for (const auto& [varied, axis] : axes) {
        std::vector<const MeasuredCell*> shown;
        for (const MeasuredCell& m : cells)
            if (&m == &cells.front() || std::string_view(m.cell.varied) == varied)
                shown.push_back(&m);
        std::ranges::sort(shown, {}, [&](const auto* m) { return varied_value(m->cell, varied); });
        SpreadChart chart{varied, axis, "error at targets [mm RMS]", {}};
        for (const auto& [name, vector] : {std::pair{"rigid", &RegisteredTarget::rigid},
                                           std::pair{"deforming", &RegisteredTarget::deforming}}) {
            SpreadLine line{name, {}, {}, {}};
            for (const MeasuredCell* m : shown) {
                const double rms = rms_over(m->runs, vector);
                double squares = 0;
                for (const RegistrationRun& run : m->runs)
                    squares += std::pow(rms_over({run}, vector) - rms, 2);
                line.x.push_back(varied_value(m->cell, varied));
                line.mean.push_back(1e3 * rms);
                line.spread.push_back(1e3 *
                                      std::sqrt(squares / static_cast<double>(m->runs.size())));
            }
            chart.lines.push_back(std::move(line));
        }
        charts.push_back(std::move(chart));
    }
    write_spread_picture(path, charts);
}

/// Registers the pulled organ by a part of its surface: rigidly, and deforming. Returns 1 if an
/// aim is missed.
int bench_registration(const RegistrationBenchArguments& a) {
    PetscSession session("livetet", {});
    if (session.ranks() > 1)
        fail("bench registration runs on one rank, found {}: start it without mpirun",
             session.ranks());
    std::optional<ProgressLine> progress;
    progress.emplace("registration");

    // 1. truths and models
    constexpr double max_rms_m = 0.015;
    const PhantomImages images = make_phantom_images(0.0015, 1);
    const BenchOrgan organ_of =
        a.surface.empty() ? phantom_organ(images) : surface_organ(a.surface);
    std::vector<MeasuredCell> cells = registration_cells(a);
    const auto model_of = [&](int tets) { return organ_of.mesh(tets, progress->callback()); };
    const MeshHierarchy model = model_of(a.tets);
    std::optional<RegistrationRun> timed;
    for (int s = 1; s <= a.seeds; ++s) {
        const auto seed = static_cast<std::uint64_t>(s);
        const PulledOrgan organ =
            pull_organ(organ_of, a.truth_tets, seed, max_rms_m, progress->callback());

        // 2. all cells
        for (MeasuredCell& m : cells) {
            progress->update(
                static_cast<double>(m.runs.size() * cells.size() + (&m - cells.data())) /
                    static_cast<double>(static_cast<std::size_t>(a.seeds) * cells.size()),
                fmt::format("seed {}, cell {} of {}", s, &m - cells.data() + 1, cells.size()));
            m.runs.push_back(run_registration(m.cell, organ, model, seed, a.prior));
        }
        if (s == 1 && !a.quick && a.only.empty())
            timed = run_registration({}, organ, model_of(a.timed_tets), seed, a.prior);
    }
    progress.reset();

    // 3. table, verdict, files
    print_cells(cells, a);
    const bool holds = a.quick || judge_registration(cells, timed ? &*timed : nullptr);
    if (!a.json.empty()) {
        nlohmann::json rows = nlohmann::json::array();
        for (const MeasuredCell& m : cells)
            for (nlohmann::json& row : json_of(m)) rows.push_back(std::move(row));
        write_text_file(a.json, rows.dump(2) + "\n");
    }
    if (!a.figure.empty()) draw_registration(a.figure, cells);
    return holds ? 0 : 1;
}

}  // namespace

void add_registration_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "registration",
        "Error at targets of a pulled organ, registered rigidly and deforming by a part of its "
        "surface, against coverage, noise, outliers and motion; exit status 1 if an aim is missed");
    auto a = std::make_shared<RegistrationBenchArguments>();
    command->add_option("--seeds", a->seeds, "pulls, drawn by seeds 1, 2, ...")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    command->add_option("--tets", a->tets, "tets of the model")
        ->capture_default_str()
        ->check(CLI::Range(500, 1000000));
    command->add_option("--truth-tets", a->truth_tets, "ten-node tets of the truth")
        ->capture_default_str()
        ->check(CLI::Range(500, 1000000));
    command->add_option("--surface", a->surface,
                        "a closed surface of an organ (mm, RAS) in place of the phantom: pulled "
                        "at its front, held at its back");
    command
        ->add_option("--only", a->only,
                     "the first cell, and those in which this is varied; no timing")
        ->check(CLI::IsMember({"coverage", "noise", "outliers", "motion", "support", "law", "zone",
                               "forces", "all"}));
    command
        ->add_option("--energy-mJ", a->prior.energy_mJ,
                     "deform.energy_mJ of the model's scene; not given: auto")
        ->check(CLI::PositiveNumber);
    command
        ->add_option("--shared-error-mm", a->prior.shared_error_mm,
                     "deform.shared_error_mm of the model's scene")
        ->capture_default_str()
        ->check(CLI::Range(0, 100));
    command
        ->add_option("--model-error-percent", a->prior.model_error_percent,
                     "deform.model_error_percent of the model's scene")
        ->capture_default_str()
        ->check(CLI::Range(0, 100));
    command->add_flag("--quick", a->quick, "the first cell alone, without a verdict");
    command->add_option("--json", a->json, "write the figures of every run to this file");
    add_figure_option(*command, "--figure", a->figure,
                      "draw the errors against coverage, noise, outliers and motion to this PNG");
    command->callback([a, &status] {
        check_output_files({a->json});
        check_figures({a->figure});
        status = bench_registration(*a);
    });
}

}  // namespace livetet
