#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/commands/commands.hpp"
#include "apps/live/tracker_recorder.hpp"
#include "apps/live/tracker_source.hpp"
#include "apps/scene/outputs.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/stop_signals.hpp"
#include "io/sequence_file.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

struct RecordArguments {
    std::string source;
    std::filesystem::path output;
    std::vector<std::string> tools;
    std::optional<double> length_s{};
};

/// Refuses invalid outputs and tools before anything is recorded.
void check(const RecordArguments& a) {
    if (ending(a.output) != ".mha")
        fail("--output {}: expected a name that ends in .igs.mha, a PLUS sequence",
             a.output.string());
    refuse_to_overwrite("--output", a.output, {a.source});
    const PendingFile writable(a.output);
    warn_of_left_parts(a.output);
    for (std::size_t i = 0; i < a.tools.size(); ++i) {
        if (!is_sequence_tool(a.tools[i]))
            fail("--tool '{}': expected a name without blanks, '=' and ':'", a.tools[i]);
        if (std::find(a.tools.begin(), a.tools.begin() + i, a.tools[i]) != a.tools.begin() + i)
            fail("--tool {}: given twice, expected each tool once", a.tools[i]);
    }
}

void record(const RecordArguments& a) {
    check(a);
    const StopSignals signals;  // until all is written
    const auto save = [&](const Recording& recording) { write_sequence(a.output, recording); };
    const TrackerRecording received = [&] {
        ProgressLine line("record");
        return record_tracker(
            a.source, {a.tools, a.length_s, signals.token(), "record", line.status(), save});
    }();
    write_sequence(a.output, received.recording);
    const auto& samples = received.recording.samples;
    const double interval_s = sample_interval(received.recording);
    const double span_s = samples.back().time_s - samples.front().time_s;
    fmt::print("samples      {} in {:.1f} s", samples.size(), span_s);
    if (interval_s > 0 && span_s > 0)
        fmt::print(", {:.1f} Hz in the mean, {:.1f} Hz by the median interval",
                   static_cast<double>(samples.size() - 1) / span_s, 1 / interval_s);
    fmt::print("\n");
    for (std::size_t i = 0; i < received.recording.tools.size(); ++i) {
        const auto seen = std::ranges::count_if(
            samples, [i](const TrackerSample& s) { return s.poses[i].status == PoseStatus::ok; });
        fmt::print("{:<12} seen in {} of them\n", received.recording.tools[i], seen);
    }
    if (!received.left_out.empty())
        fmt::print("left out     {}: expected names such as StylusToTracker\n",
                   fmt::join(received.left_out, ", "));
    fmt::print("written      {}\n", a.output.string());
}

}  // namespace

void add_record_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "record",
        "Records a tracker into a PLUS sequence. Ctrl-C ends it, and everything received is kept");
    auto a = std::make_shared<RecordArguments>();
    command
        ->add_option("source", a->source,
                     "openigtlink://host:port of a tracker server such as PLUS; or a recording or "
                     "the script of a simulated tracker (.yaml), which is read at once")
        ->required();
    command->add_option("-o,--output", a->output, "the recording (.igs.mha)")->required();
    command->add_option(
        "--tool", a->tools,
        "a tool to record, Stylus for StylusToTracker; may be repeated (default: all that come)");
    command->add_option("--for", a->length_s, "stop after this time in seconds from the first pose")
        ->check(CLI::PositiveNumber);
    command->callback([a] { record(*a); });
}

}  // namespace livetet
