#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "apps/commands.hpp"
#include "apps/report.hpp"
#include "apps/virtual_display.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "io/text.hpp"
#ifdef LIVETET_IMAGES
#include "apps/pictures.hpp"
#endif

namespace livetet {

namespace {

namespace fs = std::filesystem;

struct ReportArguments {
    fs::path result, truth, folder, json;
    bool no_pictures = false;
    bool pictures_only = false;  // how the command calls itself once it has found itself an X server
};

#ifdef LIVETET_IMAGES

void draw(const ReportArguments& arguments, const RunResult& result, const Report& report) {
    const RunFrame& deepest = result.frames[report.deepest_frame];
    write_organ_picture(arguments.folder / "organ.png", result.mesh, result.displacement(report.deepest_frame),
                        deepest.time_s);
    write_frame_times_picture(arguments.folder / "frame_times.png", result.frames, report);
    if (report.truth) write_target_error_picture(arguments.folder / "target_error.png", *report.truth);
}

/// This command once more, pictures only, under a virtual X server. Why it could not, if it could not.
std::optional<std::string> draw_under_virtual_display(const ReportArguments& arguments) {
    std::vector<std::string> words{"report", arguments.result.string(), "-o", arguments.folder.string(), "--pictures-only"};
    if (!arguments.truth.empty()) words.insert(words.end(), {"--truth", arguments.truth.string()});
    const VirtualRun run = run_under_virtual_display(words);
    if (run.why_not) return fmt::format("there is no X server, and {}", *run.why_not);
    if (run.status == 0) return std::nullopt;
    return fmt::format("there is no X server, and xvfb-run ended with status {}", run.status);
}

/// Pictures are a gift: where they cannot be had, the report stands without, and this is why.
std::optional<std::string> add_pictures(const ReportArguments& arguments, const RunResult& result, const Report& report) {
    if (!have_display()) return draw_under_virtual_display(arguments);
    draw(arguments, result, report);
    return std::nullopt;
}

/// The pictures that are in the folder, in the order in which a reader wants them.
std::vector<PagePicture> pictures_in(const fs::path& folder) {
    std::vector<PagePicture> pictures;
    for (const auto& [name, caption] : {std::pair{"organ.png", "The organ at rest and at its deepest press, coloured by displacement"},
                                        {"target_error.png", "Error at the targets over time"},
                                        {"frame_times.png", "What each frame took"}})
        if (fs::exists(folder / name)) pictures.push_back({caption, base64_of(folder / name)});
    return pictures;
}

#else

void draw(const ReportArguments&, const RunResult&, const Report&) {}

std::optional<std::string> add_pictures(const ReportArguments&, const RunResult&, const Report&) {
    return "this build of livetet draws none";
}

std::vector<PagePicture> pictures_in(const fs::path&) { return {}; }

#endif

/// A folder for pictures on their way into a page, gone with the guard.
class PassingFolder {
  public:
    PassingFolder() {
        std::string name = (fs::temp_directory_path() / "livetet_report_XXXXXX").string();
        if (!::mkdtemp(name.data())) fail("{}: the folder for pictures cannot be made", name);
        path_ = name;
    }
    ~PassingFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    PassingFolder(const PassingFolder&) = delete;
    PassingFolder& operator=(const PassingFolder&) = delete;
    const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

bool is_page(const fs::path& output) { return ending(output) == ".html" || ending(output) == ".htm"; }

void write_page(const ReportArguments& arguments, const RunResult& result, const Report& report) {
    PendingFile page(arguments.folder);  // before pictures are drawn
    std::optional<PendingFile> extra;
    if (!arguments.json.empty()) extra.emplace(arguments.json);
    std::vector<PagePicture> pictures;
    std::string why = "--no-pictures";
    if (!arguments.no_pictures) {
        const PassingFolder folder;
        ReportArguments drawn = arguments;
        drawn.folder = folder.path();
        why = add_pictures(drawn, result, report).value_or("");
        pictures = pictures_in(folder.path());
        if (!why.empty()) fmt::print(stderr, "pictures left out: {}\n", why);
    }
    write_text_file(page.path(), report_page(report, pictures, why));
    if (extra) write_text_file(extra->path(), report_json(report));
    page.commit();
    if (extra) extra->commit();
    for (const std::string& sentence : verdicts(report)) fmt::print("{}\n", sentence);
    fmt::print("written          {}, {} picture(s) in it\n", arguments.folder.string(), pictures.size());
}

/// All files or none: each is complete beside its place before the first is moved there.
void write_texts(const ReportArguments& arguments, const Report& report) {
    const std::string json = report_json(report);
    PendingFile text_file(arguments.folder / "report.txt"), json_file(arguments.folder / "report.json");
    std::optional<PendingFile> extra;
    if (!arguments.json.empty()) extra.emplace(arguments.json);
    write_text_file(text_file.path(), report_text(report));
    write_text_file(json_file.path(), json);
    if (extra) write_text_file(extra->path(), json);
    text_file.commit();
    json_file.commit();
    if (extra) extra->commit();
}

void run(ReportArguments arguments) {
    // 1. the run, and what it is measured by
    const RunResult result = read_run_result(arguments.result);
    std::optional<Truth> truth;
    if (!arguments.truth.empty()) truth = read_truth(arguments.truth);
    const Report report = make_report(result, truth ? &*truth : nullptr);
    if (arguments.folder.empty()) arguments.folder = arguments.result.parent_path() / "report";

    // 2. only pictures: called by ourselves
    if (arguments.pictures_only) {
        draw(arguments, result, report);
        return;
    }

    // 3. the page, or texts and pictures
    if (is_page(arguments.folder)) return write_page(arguments, result, report);
    std::error_code failure;
    fs::create_directories(arguments.folder, failure);
    if (failure) fail("{}: the folder cannot be made ({})", arguments.folder.string(), failure.message());
    write_texts(arguments, report);
    fmt::print("{}\n", report_text(report));
    std::fflush(stdout);
    const auto why = arguments.no_pictures ? std::nullopt : add_pictures(arguments, result, report);
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
    CLI::App* command =
        app.add_subcommand("report", "Says what a tracked run was worth: frame times, errors, pictures");
    auto arguments = std::make_shared<ReportArguments>();
    command->add_option("result", arguments->result, "what livetet track wrote (.h5)")->required();
    command->add_option("--truth", arguments->truth, "a phantom's truth (.json): errors at its hidden targets");
    command->add_option("-o,--output", arguments->folder, "folder for report.txt, report.json and pictures; or one page that holds all (.html)")
        ->default_str("report, beside the result");
    command->add_option("--json", arguments->json, "write the JSON to this file too");
    command->add_flag("--no-pictures", arguments->no_pictures, "texts only");
    command->add_flag("--pictures-only", arguments->pictures_only)->group("");
    command->callback([arguments] { run(*arguments); });
}

}  // namespace livetet
