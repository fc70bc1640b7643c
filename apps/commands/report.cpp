#include <fmt/format.h>
#include <sys/prctl.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "apps/commands/commands.hpp"
#include "apps/commands/report_result.hpp"
#include "apps/report/report.hpp"
#include "apps/report/solve_report.hpp"
#include "apps/scene/outputs.hpp"
#include "apps/warp/output_name.hpp"
#include "base/child_process.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/parallel_jobs.hpp"
#include "base/progress.hpp"
#include "base/temporary_files.hpp"
#include "base/work_folder.hpp"
#include "io/text.hpp"
#ifdef LIVETET_IMAGES
#include "apps/plots/pictures.hpp"
#endif

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// What is printed of a report: all of it, or its sentences.
enum class Shown { all, verdicts };

struct ReportArguments {
    fs::path result, truth, folder, json;
    bool no_pictures = false;
    Shown shown = Shown::all;
};

/// The options of a report on one result or several. Names of outputs may hold words in braces (see
/// output_name).
struct ReportBatch {
    std::vector<fs::path> results;
    ReportArguments like;  ///< what all reports have in common
    int threads = 0;
};

/// A report of a tracked or solved run in all its formats.
struct RunReport {
    std::vector<std::string> verdicts;
    std::string text, json;
    std::function<std::string(std::span<const PagePicture>, const std::string& no_pictures)> page;
    std::function<void(const fs::path& folder)> draw;
    std::vector<std::pair<const char*, const char*>>
        pictures;  ///< files that `draw` may write, in reading order, with captions
};

RunReport report_tracked(const ReportArguments& arguments,
                         std::shared_ptr<const ResultReader> reader) {
    const auto result =
        std::make_shared<RunResult>(read_run_result(std::move(reader), arguments.result));
    std::optional<Truth> truth;
    if (!arguments.truth.empty()) truth = read_truth(arguments.truth);
    const auto report = std::make_shared<Report>(make_report(*result, truth ? &*truth : nullptr));
    RunReport run{verdicts(*report), report_text(*report), report_json(*report), {}, {}, {}};
    run.page = [report](std::span<const PagePicture> pictures, const std::string& why) {
        return report_page(*report, pictures, why);
    };
#ifdef LIVETET_IMAGES
    run.draw = [result, report](const fs::path& folder) {
        write_organ_picture(
            folder / "organ.png", result->mesh, result->displacement(report->deepest_frame),
            fmt::format("at {:.2f} s", result->frames[report->deepest_frame].time_s));
        write_frame_times_picture(folder / "frame_times.png", result->frames, *report);
        if (report->truth) write_target_error_picture(folder / "target_error.png", *report->truth);
    };
    run.pictures = {
        {"organ.png", "The organ at rest and at its deepest press, coloured by displacement"},
        {"target_error.png", "Error at the targets over time"},
        {"frame_times.png", "What each frame took"}};
#endif
    return run;
}

RunReport report_solved(const ReportArguments& arguments,
                        std::shared_ptr<const ResultReader> result) {
    std::optional<Truth> truth;
    if (!arguments.truth.empty()) truth = read_truth(arguments.truth);
    const auto report = std::make_shared<SolveReport>(
        make_solve_report(*result, arguments.result, truth ? &*truth : nullptr));
    RunReport run{verdicts(*report), report_text(*report), report_json(*report), {}, {}, {}};
    run.page = [report](std::span<const PagePicture> pictures, const std::string& why) {
        return report_page(*report, pictures, why);
    };
#ifdef LIVETET_IMAGES
    run.draw = [result, report](const fs::path& folder) {
        TetMesh mesh = result->mesh();
        mesh.node_sets["fixed"] = report->fixed;
        write_organ_picture(folder / "body.png", mesh, result->displacement(report->largest_frame),
                            fmt::format("at {:.4g} {}", result->times_s()[report->largest_frame],
                                        report->has_load_shares() ? "of the load" : "s"));
    };
    run.pictures = {
        {"body.png", "The body at rest and where it moved farthest, coloured by displacement"}};
#endif
    return run;
}

RunReport make_run_report(const ReportArguments& arguments) {
    auto result = std::make_shared<const ResultReader>(arguments.result);
    const std::vector<std::string> names = result->value_names();
    if (std::find(names.begin(), names.end(), "tracker_from_image") == names.end())
        return report_solved(arguments, std::move(result));
    return report_tracked(arguments, std::move(result));
}

/// Draws the pictures. Returns why there are none, if there are none: the report is complete
/// without.
std::optional<std::string> add_pictures([[maybe_unused]] const fs::path& folder,
                                        [[maybe_unused]] const RunReport& run) {
#ifdef LIVETET_IMAGES
    if (const auto problem = find_display()) return "there is no X server, and " + *problem;
    run.draw(folder);
    return std::nullopt;
#else
    return "this build of livetet draws none";
#endif
}

std::vector<PagePicture> pictures_in([[maybe_unused]] const fs::path& folder,
                                     [[maybe_unused]] const RunReport& run) {
    std::vector<PagePicture> pictures;
#ifdef LIVETET_IMAGES
    for (const auto& [name, caption] : run.pictures)
        if (fs::exists(folder / name)) pictures.push_back({caption, base64_of(folder / name)});
#endif
    return pictures;
}

bool is_page(const fs::path& output) {
    return ending(output) == ".html" || ending(output) == ".htm";
}

void write_page(const ReportArguments& arguments, const RunReport& run) {
    PendingFile page(arguments.folder);  // throws before pictures are drawn if it cannot be written
    std::optional<PendingFile> extra;
    if (!arguments.json.empty()) extra.emplace(arguments.json);
    std::vector<PagePicture> pictures;
    std::string why = "--no-pictures";
    if (!arguments.no_pictures) {
        const WorkFolder folder;
        why = add_pictures(folder.path(), run).value_or("");
        pictures = pictures_in(folder.path(), run);
        if (!why.empty()) fmt::print(stderr, "pictures left out: {}\n", why);
    }
    write_text_file(page.path(), run.page(pictures, why));
    if (extra) write_text_file(extra->path(), run.json);
    page.commit();
    if (extra) extra->commit();
    for (const std::string& sentence : run.verdicts) fmt::print("{}\n", sentence);
    fmt::print("written          {}, {} in it\n", arguments.folder.string(),
               counted(pictures.size(), "picture"));
}

/// The pictures of all kinds of reports.
constexpr const char* all_pictures[] = {"organ.png", "target_error.png", "frame_times.png",
                                        "body.png"};

/// Removes the pictures of an earlier report from the folder: one that this run does not draw would
/// stand beside its texts as if it were of the same run.
void remove_old_pictures(const fs::path& folder) {
    for (const char* name : all_pictures) {
        std::error_code failure;
        fs::remove(folder / name, failure);
        if (failure)
            fail("{}: is of an earlier report and cannot be removed ({})", (folder / name).string(),
                 failure.message());
    }
}

/// Writes all files or none: each is complete under another name before the first is moved into
/// place.
void write_texts(const ReportArguments& arguments, const RunReport& run) {
    PendingFile text_file(arguments.folder / "report.txt"),
        json_file(arguments.folder / "report.json");
    std::optional<PendingFile> extra;
    if (!arguments.json.empty()) extra.emplace(arguments.json);
    write_text_file(text_file.path(), run.text);
    write_text_file(json_file.path(), run.json);
    if (extra) write_text_file(extra->path(), run.json);
    remove_old_pictures(arguments.folder);
    text_file.commit();
    json_file.commit();
    if (extra) extra->commit();
}

void run(ReportArguments arguments) {
    if (is_named_as_file(arguments.folder) && !is_page(arguments.folder) &&
        !fs::is_directory(arguments.folder))
        fail(
            "--output {}: a report is a folder, or one page (.html), found a name that ends in "
            "'{}'",
            arguments.folder.string(), ending(arguments.folder));
    refuse_to_overwrite("--json", arguments.json, {arguments.result, arguments.truth});
    // 1. the run and its references
    const RunReport run = make_run_report(arguments);
    if (arguments.folder.empty()) {
        arguments.folder = arguments.result;
        arguments.folder.replace_extension(".report");
    }

    // 2. the page, or texts and pictures
    if (is_page(arguments.folder)) return write_page(arguments, run);
    std::error_code failure;
    fs::create_directories(arguments.folder, failure);
    if (failure)
        fail("{}: the folder cannot be made ({})", arguments.folder.string(), failure.message());
    write_texts(arguments, run);
    if (arguments.shown == Shown::all) fmt::print("{}\n", run.text);
    if (arguments.shown == Shown::verdicts)
        for (const std::string& sentence : run.verdicts) fmt::print("{}\n", sentence);
    std::fflush(stdout);
    const auto why = arguments.no_pictures ? std::nullopt : add_pictures(arguments.folder, run);
    if (why) fmt::print(stderr, "pictures left out: {}\n", *why);
    fmt::print("written          {}\n", arguments.folder.string());
}

/// The arguments of each report of a batch. Throws Error if two would write one file.
std::vector<ReportArguments> reports_of(const ReportBatch& batch) {
    std::vector<ReportArguments> reports;
    std::map<fs::path, fs::path> results;  ///< by what is written of each
    for (const fs::path& result : batch.results) {
        ReportArguments& report = reports.emplace_back(batch.like);
        report.result = result;
        report.folder = output_name("--output", batch.like.folder, result, 0, 0);
        report.json = output_name("--json", batch.like.json, result, 0, 0);
        if (batch.results.size() == 1) continue;
        report.shown = Shown::verdicts;
        if (report.folder.empty()) report.folder = fs::path(result).replace_extension(".report");
        for (const fs::path& written : {report.folder, report.json})
            if (const auto [other, is_new] = results.emplace(written.lexically_normal(), result);
                !is_new && !written.empty())
                fail(
                    "{} and {}: both reports would be written to {}, expected {{result}} or "
                    "{{folder}} in its name",
                    other->second.string(), result.string(), written.string());
    }
    return reports;
}

/// Makes a report in a child process: pictures are drawn by libraries that several threads may not
/// use. Returns what it prints.
std::string report_in_child(const ReportArguments& arguments) {
    constexpr double no_limit_s = 1e9;
    constexpr char refused = 'r';
    const ChildResult child = run_in_child(
        [&](int answer) {
            ::prctl(PR_SET_PDEATHSIG, SIGTERM);  // so that it removes its temporary files
            remove_temporary_files_at_signals();
            try {
                run(arguments);
            } catch (const Error& e) {
                const std::string text = refused + std::string(e.what());
                return write_all(answer, text.data(), text.size()) ? 0 : 1;
            }
            return 0;
        },
        no_limit_s);
    if (child.end != ChildResult::End::returned)
        fail("{}: the report {}", arguments.result.string(), describe_end(child, no_limit_s));
    if (!child.result.empty())
        throw Error(std::string(child.result.begin() + 1, child.result.end()));
    return child.log;
}

void run_batch_of_reports(const std::vector<ReportArguments>& reports, int threads) {
    constexpr int max_displays = 4;  // that are sure to find numbers when started at once
    const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency())),
              workers = std::min(
                  {threads > 0 ? threads : cores, max_displays, static_cast<int>(reports.size())});
    std::vector<std::string> printed(reports.size());
    JobsEnd end;
    {
        ProgressLine progress("report");
        std::mutex mutex;
        std::size_t ended = 0;
        const auto report_end = [&](const fs::path& result) {
            const std::lock_guard lock(mutex);
            ++ended;
            progress.update(static_cast<double>(ended) / static_cast<double>(reports.size()),
                            result.string());
        };
        end = run_jobs(reports.size(), workers, AfterError::go_on, [&](std::size_t n) {
            printed[n] = report_in_child(reports[n]);
            report_end(reports[n].result);
        });
    }
    for (std::size_t n = 0; n < reports.size(); ++n)
        if (!printed[n].empty())
            fmt::print("result           {}\n{}\n", reports[n].result.string(), printed[n]);
    std::fflush(stdout);
    if (!end.first_error) return;
    try {
        std::rethrow_exception(end.first_error);
    } catch (const Error& e) {
        if (end.failed == 1)
            fail("{} ({} of {} reports are written)", e.what(), end.done, reports.size());
        fail("{} (the first of {} that failed; {} of {} reports are written)", e.what(), end.failed,
             end.done, reports.size());
    }
}

void run_reports(const ReportBatch& batch) {
    const std::vector<ReportArguments> reports = reports_of(batch);
    if (reports.size() == 1)
        run(reports.front());
    else
        run_batch_of_reports(reports, batch.threads);
}

}  // namespace

void report_result(const std::filesystem::path& result, const std::filesystem::path& json) {
    ReportArguments arguments;
    arguments.result = result;
    arguments.json = json;
    run(std::move(arguments));
}

void add_report_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "report", "Reports on a run: errors, frame times or steps, what was left out, pictures");
    auto batch = std::make_shared<ReportBatch>();
    command
        ->add_option("results", batch->results,
                     "results of livetet track or solve (.h5); several are reported on side by "
                     "side, each in a process of its own")
        ->required();
    command->add_option("--truth", batch->like.truth,
                        "a phantom's truth (.json): errors at its hidden targets");
    command
        ->add_option("-o,--output", batch->like.folder,
                     "folder for report.txt, report.json and pictures, without those of an earlier "
                     "report; or "
                     "one page with all of it (.html); of several results with {result} or "
                     "{folder}, the result's name and folder")
        ->default_str("RESULT.report, beside RESULT.h5");
    command->add_option("--json", batch->like.json,
                        "also write the JSON to this file; {result}, {folder} as in --output");
    command->add_flag("--no-pictures", batch->like.no_pictures, "texts only");
    command->add_option("--threads", batch->threads, "reports at a time; 0: one a core, 4 at most")
        ->capture_default_str()
        ->check(CLI::Range(0, 64));
    command->callback([batch] { run_reports(*batch); });
}

}  // namespace livetet
