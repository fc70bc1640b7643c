#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "apps/commands/commands.hpp"
#include "apps/study/scheduler.hpp"
#include "base/counted.hpp"
#include "base/distribution.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "io/text.hpp"
#include "solvers/parallel/first_rank.hpp"
#include "solvers/parallel/petsc_session.hpp"
#ifdef LIVETET_IMAGES
#include "apps/commands/study_charts.hpp"
#endif

namespace livetet {

namespace {

struct StudyArguments {
    std::filesystem::path study;
    bool list = false;
};

void print_list(const Study& study) {
    std::vector<std::size_t> widths;
    for (std::size_t i = 0; i < study.options.vary.size(); ++i) {
        std::size_t width = study.options.vary[i].key.size();
        for (const auto& sample : study.samples) width = std::max(width, sample[i].size());
        widths.push_back(width);
    }
    fmt::print("{:>7}", "solve");
    for (std::size_t i = 0; i < widths.size(); ++i)
        fmt::print("  {:>{}}", study.options.vary[i].key, widths[i]);
    fmt::print("\n");
    for (std::size_t k = 0; k < study.samples.size(); ++k) {
        fmt::print("{:>7}", k);
        for (std::size_t i = 0; i < widths.size(); ++i)
            fmt::print("  {:>{}}", study.samples[k][i], widths[i]);
        fmt::print("\n");
    }
}

void print_summary(const StudyTable& table, const Study& study) {
    constexpr std::size_t max_printed = 5;
    std::size_t failed = 0, width = 6;
    double seconds = 0;
    for (const std::string& failure : table.failures) failed += !failure.empty();
    for (const double s : table.seconds) seconds += s;
    for (const std::string& name : table.outputs) width = std::max(width, name.size());
    fmt::print("solves           {}, {} converged, {:.1f} s of solving in all\n",
               table.values.size(), table.values.size() - failed, seconds);
    fmt::print("\n{:<{}} {:>12} {:>12} {:>12}{}\n", "output", width, "least", "median", "most",
               failed > 0 ? "   of those that converged" : "");
    for (std::size_t i = 0; i < table.outputs.size(); ++i) {
        std::vector<double> values;
        for (std::size_t k = 0; k < table.results.size(); ++k)
            if (table.failures[k].empty() && !std::isnan(table.results[k][i]))
                values.push_back(table.results[k][i]);
        if (values.empty()) continue;
        std::sort(values.begin(), values.end());
        fmt::print("{:<{}} {:>12.5g} {:>12.5g} {:>12.5g}\n", table.outputs[i], width,
                   values.front(), percentile(values, 0.5), values.back());
    }
    const auto solves_with = [&](const char* output) {
        const auto column =
            std::find(table.outputs.begin(), table.outputs.end(), output) - table.outputs.begin();
        return std::count_if(table.results.begin(), table.results.end(), [&](const auto& row) {
            return column < static_cast<std::ptrdiff_t>(row.size()) && row[column] > 0;
        });
    };
    if (const auto count = solves_with(inverted_tets_output); count > 0)
        fmt::print(
            "\n{} ended with inverted tets ({}): the largest stress may be one that no tissue has; "
            "a finer mesh or a gentler load may help\n",
            counted(count, "solve"), inverted_tets_output);
    if (const auto count = solves_with(beyond_model_output); count > 0)
        fmt::print(
            "\n{} went beyond what the model stands for ({}): strains, rotations or displacements "
            "are too "
            "large for it; `livetet solve` of one says which\n",
            counted(count, "solve"), beyond_model_output);
    if (failed > 0) fmt::print("\n{} not solved:\n", failed);
    for (std::size_t k = 0, printed = 0; k < table.failures.size() && printed < max_printed; ++k) {
        if (table.failures[k].empty()) continue;
        fmt::print("  solve {}: {}\n", k, table.failures[k]);
        if (++printed == max_printed && failed > max_printed)
            fmt::print("  ... the others are in the table\n");
    }
    std::filesystem::path csv = study.options.output;
    fmt::print("\nwritten          {}, {}\n", study.options.output.string(),
               csv.replace_extension(".csv").filename().string());
}

void draw(const StudyTable& table, const Study& study) {
#ifdef LIVETET_IMAGES
    if (study.options.plots.empty()) return;
    if (const auto problem = find_display())
        return fmt::print(stderr, "no pictures: there is no X server, and {}\n", *problem);
    for (const std::string& output : study.options.plots) {
        if (std::find(table.outputs.begin(), table.outputs.end(), output) == table.outputs.end()) {
            fmt::print(stderr, "plots: no solve has an output {}, expected one of {}\n", output,
                       fmt::join(table.outputs, ", "));
            continue;
        }
        std::string name = output;  // valid in a file name
        std::replace_if(
            name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
        std::filesystem::path picture = study.options.output;
        picture.replace_filename(fmt::format("{}_{}.png", picture.stem().string(), name));
        const std::vector<ScatterChart> charts = study_charts(table, study, output);
        if (charts.empty()) continue;
        const auto converged =
            std::count(table.failures.begin(), table.failures.end(), std::string());
        const std::string all = counted(table.values.size(), "solve");
        const bool some = converged < static_cast<std::ptrdiff_t>(table.values.size());
        write_scatter_picture(
            picture,
            fmt::format("{} of {}", output,
                        some ? fmt::format("the {} of {} that converged", converged, all) : all),
            charts);
        fmt::print("picture          {}\n", picture.string());
    }
#else
    (void)table;
    if (!study.options.plots.empty()) fmt::print(stderr, "no pictures: this build has no VTK\n");
#endif
}

/// 3 if no solve converged, 4 if some did not.
int status_of(const std::vector<std::string>& failures) {
    const auto converged = std::count(failures.begin(), failures.end(), std::string());
    if (converged == std::ssize(failures)) return 0;
    return converged == 0 ? 3 : 4;
}

int run_study(const StudyArguments& arguments, const std::vector<std::string>& petsc) {
    // 1. inputs
    PetscSession session("livetet", petsc);  // first, so that only one rank reports an error
    Study study = [&] {
        std::optional<ProgressLine> line;
        if (session.rank() == 0) line.emplace("study");
        return load_study(arguments.study, line ? line->callback() : ProgressCallback{});
    }();
    study.petsc_options = fmt::format("{}", fmt::join(petsc, " "));
    if (arguments.list) {
        if (session.rank() == 0) print_list(study);
        return 0;
    }
    session.add_options(load_scene(study.options.scene).solver.petsc_options);
    const bool first = session.rank() == 0;
    StudyStore store(study);

    // 2. completed solves
    int complete = first && store.is_complete();
    MPI_Bcast(&complete, 1, MPI_INT, 0, PETSC_COMM_WORLD);
    if (!complete) check_ranks(study, session.ranks());

    // 3. remaining solves
    if (!complete) {
        on_first_rank([&] {
            check_meshes(study);
            store.open();
            if (std::filesystem::exists(study.options.output))
                log_info(fmt::format("note         {} of the {} are taken from {}",
                                     store.count_done(), counted(study.samples.size(), "solve"),
                                     study.options.output.string()));
        });
        std::optional<ProgressLine> line;
        if (first) line.emplace("study");
        solve_remaining(study, store, line ? line->callback() : ProgressCallback{});
    }
    if (!first) return 0;

    // 4. one file of all solves
    if (!complete) {
        ProgressLine line("study");
        store.write_result(line.callback());
    }
    store.remove();
    const StudyTable table = StudyFile(study.options.output).table();
    if (complete) fmt::print("{} is complete\n", study.options.output.string());
    print_summary(table, study);
    draw(table, study);
    session.tell_unused_options(PetscSession::Moment::end);
    return status_of(table.failures);
}

}  // namespace

void add_study_command(CLI::App& app, ExitStatus& status) {
    CLI::App* command =
        app.add_subcommand("study",
                           "Solves a scene many times with varied parameters, under mpirun; run "
                           "again after an interruption, it continues");
    command->footer(
        "Other options with one dash go to PETSc: -log_view ...\nThe keys of a study: livetet "
        "scene --study.");
    auto arguments = std::make_shared<StudyArguments>();
    command->add_option("study", arguments->study, "study file (YAML)")->required();
    command->add_flag("--list", arguments->list, "print the planned solves, and solve nothing");
    command->allow_extras();
    command->callback([command, arguments, &status] {
        status.value = run_study(*arguments, petsc_arguments(*command));
    });
}

}  // namespace livetet
