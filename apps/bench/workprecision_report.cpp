#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/bench/benchmarks.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/workprecision_bench.hpp"
#include "base/file.hpp"
#include "base/work_folder.hpp"
#ifdef LIVETET_IMAGES
#include "apps/plots/pictures.hpp"
#endif

namespace livetet {

namespace {

using nlohmann::json;

struct WorkPrecisionArguments {
    std::filesystem::path scene, csv, json, figure, memory_figure, folder;
    int repeats = 3;
    double time_limit_s = 600;
    std::string only;
};

constexpr double frame_s = 0.010;  // step time of the recommendation

double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : 0; }

void print_table(const WorkPrecision& w) {
    fmt::print("\nreference: {:.3f} mm at most, {:.3f} mm in the mean (L2), {:.1f} s\n\n",
               1e3 * w.largest_m, 1e3 * w.mean_m, w.reference_s);
    fmt::print(
        "{:>3}  {:<46} {:>8} {:>7} {:>8} {:>8} {:>7} | {:>8} {:>6} {:>8} {:>6} | {:>8} {:>8} {:>8} "
        "{:>8}\n",
        "", "", "total", "spread", "set-up", "a step", "memory", "largest", "", "L2", "", "mesh",
        "time", "algebra", "model");
    fmt::print(
        "{:>3}  {:<46} {:>8} {:>7} {:>8} {:>8} {:>7} | {:>8} {:>6} {:>8} {:>6} | {:>8} {:>8} {:>8} "
        "{:>8}\n",
        "", "", "s", "s", "s", "ms", "MB", "mm", "%", "mm", "%", "mm", "mm", "mm", "mm");
    for (std::size_t k = 0; k < w.results.size(); ++k) {
        const ChoiceResult& r = w.results[k];
        fmt::print("{:>3}  {:<46} ", k + 1, r.choice.name);
        if (!r.has_figures())
            fmt::print("{}\n", r.failure);
        else
            fmt::print(
                "{:>8.3f} {:>7} {:>8.3f} {:>8.2f} {:>7.0f} | {:>8.4f} {:>6.2f} {:>8.4f} {:>6.2f} | "
                "{:>8.4f} {:>8.4f} {:>8.4f} {:>8.4f}\n",
                r.total_s, r.runs > 1 ? fmt::format("{:.3f}", r.spread_s) : "once", r.setup_s,
                1e3 * r.step_s, r.peak_bytes / 1e6, 1e3 * r.error.largest_m,
                percent(r.error.largest_m, w.largest_m), 1e3 * r.error.l2_m,
                percent(r.error.l2_m, w.mean_m), 1e3 * r.mesh_m, 1e3 * r.time_m,
                1e3 * r.algebraic_m, 1e3 * r.model_m);
    }
}

void recommend(const WorkPrecision& w) {
    fmt::print("\nOn this machine, of what was measured:\n");
    const auto say = [](const std::string& what, const ChoiceResult* r) {
        if (r)
            fmt::print(
                "{:<52} {} ({}): {:.3f} mm at most, {:.3f} mm L2, {:.3f} s in all, {:.2f} ms a "
                "step, {:.0f} MB\n",
                what, r->choice.name, r->choice.varied, 1e3 * r->error.largest_m,
                1e3 * r->error.l2_m, r->total_s, 1e3 * r->step_s, r->peak_bytes / 1e6);
        else
            fmt::print("{:<52} none\n", what);
    };
    for (const ErrorMeasure measure : {ErrorMeasure::largest, ErrorMeasure::l2}) {
        const char* of = measure == ErrorMeasure::largest ? "largest" : "L2";
        for (const double error_m : {1e-3, 1e-4})
            say(fmt::format("cheapest with an error ({}) under {} mm:", of, 1e3 * error_m),
                w.cheapest(measure, error_m));
        say(fmt::format("most accurate ({}) with {:.0f} ms a step at most:", of, 1e3 * frame_s),
            w.most_accurate(measure, frame_s));
    }
}

std::string csv_text(const WorkPrecision& w) {
    std::string text =
        "number,varied,name,level,converged,runs,total_s,spread_s,setup_s,step_s,peak_bytes,"
        "largest_mm,l2_mm,mesh_mm,time_mm,algebraic_mm,model_mm";
    for (const std::string& probe : w.probes) text += fmt::format(",{}_mm", probe);
    text += ",failure\n";
    for (std::size_t k = 0; k < w.results.size(); ++k) {
        const ChoiceResult& r = w.results[k];
        text += fmt::format("{},\"{}\",\"{}\",{},{}", k + 1, r.choice.varied, r.choice.name,
                            r.choice.level, r.has_figures());
        if (r.has_figures()) {
            for (const double x :
                 {static_cast<double>(r.runs), r.total_s, r.spread_s, r.setup_s, r.step_s,
                  r.peak_bytes, 1e3 * r.error.largest_m, 1e3 * r.error.l2_m, 1e3 * r.mesh_m,
                  1e3 * r.time_m, 1e3 * r.algebraic_m, 1e3 * r.model_m})
                text += fmt::format(",{:.6g}", x);
            for (const double x : r.error.probes_m) text += fmt::format(",{:.6g}", 1e3 * x);
        } else {
            text += std::string(12 + w.probes.size(), ',');
        }
        std::string why = r.failure;
        std::replace(why.begin(), why.end(), '"', '\'');
        text += fmt::format(",\"{}\"\n", why);
    }
    return text;
}

json json_of(const WorkPrecision& w) {
    json list = json::array();
    for (const ChoiceResult& r : w.results) {
        json j{{"varied", r.choice.varied},
               {"name", r.choice.name},
               {"level", r.choice.level},
               {"converged", r.has_figures()}};
        if (r.has_figures()) {
            json probes = json::object();
            for (std::size_t i = 0; i < w.probes.size(); ++i)
                probes[w.probes[i]] = 1e3 * r.error.probes_m[i];
            j.update({{"runs", r.runs},
                      {"total_s", r.total_s},
                      {"spread_s", r.spread_s},
                      {"setup_s", r.setup_s},
                      {"step_s", r.step_s},
                      {"peak_bytes", r.peak_bytes},
                      {"largest_mm", 1e3 * r.error.largest_m},
                      {"largest_percent", percent(r.error.largest_m, w.largest_m)},
                      {"l2_mm", 1e3 * r.error.l2_m},
                      {"l2_percent", percent(r.error.l2_m, w.mean_m)},
                      {"mesh_mm", 1e3 * r.mesh_m},
                      {"time_mm", 1e3 * r.time_m},
                      {"algebraic_mm", 1e3 * r.algebraic_m},
                      {"model_mm", 1e3 * r.model_m},
                      {"probes_mm", probes}});
        } else {
            j["failure"] = r.failure;
        }
        list.push_back(std::move(j));
    }
    return {{"reference",
             {{"largest_mm", 1e3 * w.largest_m},
              {"l2_mm", 1e3 * w.mean_m},
              {"seconds", w.reference_s}}},
            {"choices", list}};
}

#ifdef LIVETET_IMAGES
void draw(const std::filesystem::path& path, const WorkPrecision& w, const std::string& title,
          const std::string& axis, double (*cost)(const ChoiceResult&)) {
    ChoicesChart chart{title, axis, "largest error [mm]", {}};
    for (std::size_t k = 0; k < w.results.size(); ++k)
        if (const ChoiceResult& r = w.results[k]; r.has_figures() && r.error.largest_m > 0)
            chart.points.push_back(
                {k + 1, r.choice.varied, r.choice.name, cost(r), 1e3 * r.error.largest_m});
    write_choices_picture(path, chart);
}
#endif

/// Prints a table and a recommendation, and writes files. Returns 3 if no choice has figures.
int bench_workprecision(const WorkPrecisionArguments& a) {
    const Scene scene = load_scene(std::filesystem::absolute(a.scene));
    const WorkFolder folder(a.folder);
    const auto keep = [&](const WorkPrecision& w) {
        if (!a.csv.empty()) write_text_file(a.csv, csv_text(w));
        if (!a.json.empty()) write_text_file(a.json, json_of(w).dump(2) + "\n");
    };
    const WorkPrecision w =
        measure_choices(scene, folder.path(), {a.repeats, a.only, a.time_limit_s, keep});
    keep(w);
    print_table(w);
    if (w.interrupted) {
        fmt::print("\nended after {} choices; no figures of the others\n", w.results.size());
        std::fflush(stdout);
        throw *w.interrupted;
    }
    recommend(w);
#ifdef LIVETET_IMAGES
    const std::string name = a.scene.stem().string();
    if (!a.figure.empty())
        draw(a.figure, w, name + ": error against run time", "set-up and all steps [s]",
             [](const ChoiceResult& r) { return r.total_s; });
    if (!a.memory_figure.empty())
        draw(a.memory_figure, w, name + ": error against memory", "peak memory [MB]",
             [](const ChoiceResult& r) { return r.peak_bytes / 1e6; });
#endif
    const bool any = std::any_of(w.results.begin(), w.results.end(),
                                 [](const ChoiceResult& r) { return r.has_figures(); });
    return any ? 0 : 3;
}

}  // namespace

void add_workprecision_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "workprecision",
        "Error of one scene against run time and memory, over elements, meshes, tolerances, "
        "solvers and schemes; the reference is ten-node tets on the finest mesh; ends with a "
        "recommendation");
    auto a = std::make_shared<WorkPrecisionArguments>();
    command->add_option("scene", a->scene, "scene file (YAML)")->required();
    command
        ->add_option("--repeats", a->repeats,
                     "rounds whose median time is reported; choices slower than 5 s run once")
        ->capture_default_str()
        ->check(CLI::Range(1, 100));
    command->add_option("--only", a->only,
                        "only choices with this in their name, such as \"solver\" or "
                        "\"level 1, P2\"");
    command
        ->add_option("--time-limit", a->time_limit_s,
                     "seconds for each solve of a choice; one that takes longer is given up")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command->add_option("--folder", a->folder, "keep meshes, scenes and logs here");
    command->add_option("--csv", a->csv,
                        "write the figures of every choice to this file, which grows with each");
    command->add_option("--json", a->json, "the same as JSON");
    add_figure_option(*command, "--figure", a->figure, "draw error against run time to this PNG");
    add_figure_option(*command, "--memory-figure", a->memory_figure,
                      "draw error against memory to this PNG");
    command->callback([a, &status] {
        check_output_files({a->csv, a->json});
        check_figures({a->figure, a->memory_figure});
        status = bench_workprecision(*a);
    });
}

}  // namespace livetet
