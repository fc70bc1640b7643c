#include "apps/live/tracker_recorder.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "apps/live/tracker_source.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "io/openigtlink/plus_pose.hpp"
#include "io/sequence_file.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

/// Collects samples of the source's thread.
class SampleLog {
  public:
    void keep(const StreamSample& sample) {
        const std::lock_guard lock(mutex_);
        const bool came = std::ranges::any_of(sample.sample.poses, was_reported);
        if (!came && samples_.empty()) return;
        if (samples_.empty()) first_s_ = sample.arrived_s;
        samples_.push_back(sample.sample);
    }
    std::size_t size() const {
        const std::lock_guard lock(mutex_);
        return samples_.size();
    }
    /// Arrival of the first sample, steady clock.
    std::optional<double> first_s() const {
        const std::lock_guard lock(mutex_);
        return samples_.empty() ? std::nullopt : std::optional(first_s_);
    }
    /// All samples so far, up to the last in which a tool came, each with a pose for each of
    /// `tools`.
    Recording recording(std::vector<std::string> tools) const {
        Recording recording{std::move(tools), {}};
        auto& samples = recording.samples;
        {
            const std::lock_guard lock(mutex_);
            samples = samples_;
        }
        while (!samples.empty() && std::ranges::none_of(samples.back().poses, was_reported))
            samples.pop_back();
        for (TrackerSample& sample : samples) sample.poses.resize(recording.tools.size());
        return recording;
    }

  private:
    mutable std::mutex mutex_;
    std::vector<TrackerSample> samples_;
    double first_s_ = 0;
};

/// Whether this names a transform, such as `StylusToReference`, and not a tool.
bool is_transform(std::string_view name) {
    for (std::size_t i = name.find("To", 1); i != std::string_view::npos;
         i = name.find("To", i + 1))
        if (i + 2 < name.size() && name[i + 2] >= 'A' && name[i + 2] <= 'Z') return true;
    return false;
}

/// The tool of a name on the wire: Stylus for StylusToTracker (PLUS) and for Stylus.
std::optional<std::string> tool_of(std::string_view name) {
    if (name.ends_with(to_tracker))
        name.remove_suffix(to_tracker.size());
    else if (is_transform(name))
        return std::nullopt;
    return is_sequence_tool(name) ? std::optional<std::string>(name) : std::nullopt;
}

/// Requests this tool from the source. False if its name cannot be told from that of another.
bool is_followed(TrackerSource& source, const std::string& tool) {
    try {
        (void)source.index_of(tool);
        return true;
    } catch (const Error&) {
        return false;
    }
}

/// Requests all tools that have come since the last call. Returns the names that are no tools.
std::vector<std::string> follow_all(TrackerSource& source) {
    std::vector<std::string> others;
    for (const auto& [name, count] : source.status().names) {
        const auto tool = tool_of(name);
        if (!tool || !is_followed(source, *tool)) others.push_back(name);
    }
    return others;
}

/// "20.0 Hz, 134 samples: StylusToTracker", or why nothing comes.
std::string status_text(const SourceStatus& status, std::size_t samples, double rate_Hz) {
    const std::string names = names_text(status);
    std::string text = fmt::format("{:.1f} Hz, {} samples", rate_Hz, samples);
    if (!names.empty()) text += fmt::format("; what comes: {}", names);
    if (status.state != "receiving") text += fmt::format("; {}", status.state);
    if (status.state != "receiving" && !status.problem.empty())
        text += fmt::format(" ({})", status.problem);
    if (!names.empty() && !status.never_came.empty())
        text += fmt::format("; no {} yet", fmt::join(status.never_came, ", "));
    return text;
}

/// Saves the recording from time to time, in case the program or the machine fails.
class Saving {
  public:
    explicit Saving(const RecordingOptions& options) : options_(options) {}
    void in_time(const TrackerSource& source, const SampleLog& log) {
        const double now_s = steady_seconds();
        if (!options_.save || now_s < due_s_ || log.size() == 0) return;
        try {
            options_.save(log.recording(source.tools()));
        } catch (const Error& error) {  // recording goes on; if the disk stays full, the last save
                                        // reports it
            log_warning(fmt::format("{}; recording continues", error.what()));
        }
        due_s_ =
            steady_seconds() + std::max(options_.save_every_s, 20 * (steady_seconds() - now_s));
    }

  private:
    const RecordingOptions& options_;
    double due_s_ = steady_seconds() + options_.save_every_s;
};

/// Waits a moment, or for the next sample of a file; false after its last one.
bool wait_a_moment(const OpenSource& open) {
    if (!open.is_streaming()) return open.source->next() != nullptr;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return true;
}

/// Waits until the requested time is over, a stop is requested, or a file ends. Requests tools as
/// they come if none were asked for. Returns the names that are no tools.
std::vector<std::string> wait_for_end(const OpenSource& open, const SampleLog& log,
                                      const RecordingOptions& options) {
    TrackerSource& source = *open.source;
    const double began_s = steady_seconds();
    Rate rate;
    Saving saving(options);
    std::vector<std::string> others;
    while (!options.stop.stop_requested() && wait_a_moment(open)) {
        if (options.tools.empty()) others = follow_all(source);
        const double seconds = steady_seconds() - log.first_s().value_or(began_s);
        const std::size_t samples = log.size();
        const std::string text = status_text(source.status(), samples, rate(samples));
        if (options.show && !open.is_streaming())
            options.show(static_cast<double>(samples) / static_cast<double>(open.samples), text);
        else if (options.show && options.length_s)
            options.show(std::min(1.0, seconds / *options.length_s), text);
        else if (options.show)
            options.show({}, text + " (Ctrl-C ends it)");
        if (options.length_s && seconds >= *options.length_s) break;
        saving.in_time(source, log);
        if (options.watch && samples > 0) options.watch(log.recording(source.tools()));
    }
    return others;
}

[[noreturn]] void refuse_nothing(const std::string& source, const std::vector<std::string>& tools,
                                 const SourceStatus& status) {
    const std::string names = names_text(status);
    if (names.empty())
        fail("{}: nothing came, expected a tracker server that sends ({})", source,
             status.problem.empty() ? status.state : status.problem);
    fail("{}: no {} came; what comes: {}{}", source,
         tools.empty() ? "tool such as StylusToTracker" : fmt::format("{}", fmt::join(tools, ", ")),
         names, status.refused > 0 ? fmt::format(" ({})", status.refusal) : "");
}

/// Of a stream, or of a file that is played.
TrackerRecording record_played(const std::string& name, const RecordingOptions& options) {
    SampleLog log;
    const OpenSource open =
        open_source(name, options.tools, {1, [&](const StreamSample& s) { log.keep(s); }});
    TrackerRecording received;
    received.left_out = wait_for_end(open, log, options);
    const SourceStatus status = open.source->status();
    received.recording = log.recording(open.source->tools());
    if (received.recording.samples.empty()) refuse_nothing(name, options.tools, status);
    if (status.refused > 0)
        log_warning(
            fmt::format("{}: {} messages were refused ({})", name, status.refused, status.refusal));
    if (!options.tools.empty()) received.never_came = status.never_came;
    return received;
}

/// The requested tools and length of a recording read from a file.
Recording part_of(Recording whole, const RecordingOptions& options) {
    std::vector<std::size_t> places;
    for (const std::string& tool : options.tools) places.push_back(tool_index(whole, tool));
    Recording part{options.tools.empty() ? whole.tools : options.tools, {}};
    for (TrackerSample& sample : whole.samples) {
        if (options.length_s && sample.time_s - whole.samples.front().time_s > *options.length_s)
            break;
        TrackerSample& kept = part.samples.emplace_back();
        kept.time_s = sample.time_s;
        if (options.tools.empty()) kept.poses = std::move(sample.poses);
        for (const std::size_t i : places) kept.poses.push_back(sample.poses[i]);
    }
    return part;
}

}  // namespace

TrackerRecording record_tracker(const std::string& source, const RecordingOptions& options) {
    if (is_stream(source) || options.watch) return record_played(source, options);
    Recording recording = read_stored(source).recording;
    return {with_context(source, [&] { return part_of(std::move(recording), options); })};
}

Recording read_source(const std::string& source, const RecordingOptions& options) {
    TrackerRecording received = record_tracker(source, options);
    if (!received.never_came.empty())
        fail("{}: no {} came, expected each of {}", source, fmt::join(received.never_came, ", "),
             fmt::join(options.tools, ", "));
    return std::move(received.recording);
}

}  // namespace livetet
