#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/progress.hpp"
#include "base/stop_token.hpp"
#include "tracking/sample.hpp"

namespace livetet {

struct RecordingOptions {
    std::vector<std::string> tools{};  ///< empty: all that come
    /// From the first pose; none: to the source's end, or until `stop`.
    std::optional<double> length_s{};
    StopToken stop{};
    std::string title = "record";  ///< what the recording is for
    StatusCallback show{};
    std::function<void(const Recording&)>
        save{};                ///< of a stream: called repeatedly with all samples so far
    double save_every_s = 10;  ///< less often if saving takes long
    /// Called again and again, by the thread that records, with all samples so far. A file is then
    /// played at its own pace.
    std::function<void(const Recording&)> watch{};
};

/// A recording, and what is not in it.
struct TrackerRecording {
    Recording recording;
    std::vector<std::string> never_came{};  ///< requested tools without a pose
    std::vector<std::string>
        left_out{};  ///< names that are no tools, such as "StylusTipToReference"
};

/// Records a source (see `open_source`): a stream as it comes, until `options.length_s` is over or
/// `options.stop` asks for it; a file at once, unless it is watched. The recording of a stream
/// begins with the first sample in which a tool comes and ends with the last. Throws Error if
/// nothing came, with the reason, or if a file lacks a requested tool.
TrackerRecording record_tracker(const std::string& source, const RecordingOptions& options);

/// Like `record_tracker`, but throws Error if a requested tool never came.
Recording read_source(const std::string& source, const RecordingOptions& options);

/// Calls `read_source` with a stop token of the caller's.
using SourceReader =
    std::function<Recording(const std::string& source, const RecordingOptions& options)>;

}  // namespace livetet
