#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/bench/benchmarks.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/verification/suite.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"
#include "solvers/parallel/petsc_session.hpp"
#ifdef LIVETET_IMAGES
#include "apps/plots/pictures.hpp"
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
/// Draws error against time of the cases with a sequence of meshes: the gain by P2, and by
/// pressures.
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

/// Runs every case, prints a table and writes files. Returns 1 if a case misses its tolerance or
/// order.
int bench_verification(const VerificationArguments& arguments) {
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
    fmt::print("\n{} of {} within their tolerances and orders ({} reported, not judged)\n",
               judged - failed, judged, outcomes.size() - judged);
    if (!arguments.csv.empty()) write_text_file(arguments.csv, csv_text(outcomes));
    if (!arguments.json.empty()) write_text_file(arguments.json, json_of(outcomes).dump(2) + "\n");
#ifdef LIVETET_IMAGES
    if (!arguments.figure.empty()) draw(arguments.figure, outcomes);
#endif
    return failed ? 1 : 0;
}

}  // namespace

void add_verification_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "verification",
        "Every case with a published or closed-form value: reference, computed value, error, "
        "observed order; exit status 1 if a case misses its tolerance or order");
    auto a = std::make_shared<VerificationArguments>();
    command->add_option("--only", a->only, "only cases with this in their name");
    command->add_option("--csv", a->csv, "write every run of every case to this file");
    command->add_option("--json", a->json, "the same as JSON");
    add_figure_option(*command, "--figure", a->figure, "draw error against time to this PNG");
    command->callback([a, &status] {
        check_output_files({a->csv, a->json});
        check_figures({a->figure});
        status = bench_verification(*a);
    });
}

}  // namespace livetet
