#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "apps/commands/commands.hpp"
#include "apps/commands/report_result.hpp"
#include "apps/report/report.hpp"
#include "apps/report/solve_report.hpp"
#include "apps/scene/outputs.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/work_folder.hpp"
#include "io/text.hpp"
#ifdef LIVETET_IMAGES
#include "apps/plots/pictures.hpp"
#endif

namespace livetet {

namespace {

namespace fs = std::filesystem;

struct ReportArguments {
    fs::path result, truth, folder, json;
    bool no_pictures = false;
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
    if (!arguments.truth.empty())
        fail("--truth: {} holds no tracked poses, expected the result of livetet track",
             arguments.result.string());
    const auto report = std::make_shared<SolveReport>(make_solve_report(*result, arguments.result));
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
                                        report->is_static() ? "of the load" : "s"));
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
    fmt::print("{}\n", run.text);
    std::fflush(stdout);
    const auto why = arguments.no_pictures ? std::nullopt : add_pictures(arguments.folder, run);
    if (why) fmt::print(stderr, "pictures left out: {}\n", *why);
    fmt::print("written          {}\n", arguments.folder.string());
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
    auto arguments = std::make_shared<ReportArguments>();
    command->add_option("result", arguments->result, "result of livetet track or solve (.h5)")
        ->required();
    command->add_option("--truth", arguments->truth,
                        "a phantom's truth (.json): errors at its hidden targets");
    command
        ->add_option("-o,--output", arguments->folder,
                     "folder for report.txt, report.json and pictures, without those of an earlier "
                     "report; or "
                     "one page with all of it (.html)")
        ->default_str("RESULT.report, beside RESULT.h5");
    command->add_option("--json", arguments->json, "also write the JSON to this file");
    command->add_flag("--no-pictures", arguments->no_pictures, "texts only");
    command->callback([arguments] { run(*arguments); });
}

}  // namespace livetet
