#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/stop_token.hpp"
#include "tracking/sample.hpp"

namespace livetet {

struct RecordingOptions {
    std::vector<std::string> tools{};  ///< none: every one that comes
    double seconds = 0;  ///< from the first pose on; 0: to the source's end, or until `stop`
    StopToken stop{};
    std::string title = "record";  ///< of the status line
    std::function<void(const Recording&)>
        save{};                ///< of a stream: given what has come so far, again and again
    double save_every_s = 10;  ///< more rarely where it takes long
};

/// What came.
struct TrackerRecording {
    Recording recording;
    std::vector<std::string> never_came{};  ///< tools asked for
    std::vector<std::string>
        left_out{};  ///< names that came and are no tool's ("StylusTipToReference")
};

/// Takes down a source (see `open_source`): a stream as it comes, with a status line, until
/// `seconds` are over or `options.stop` asks for it; a file at once. A stream's recording
/// begins with the first sample in which a tool comes and ends with the last. Throws Error where
/// nothing came, saying why, and where a file has no tool of that name.
TrackerRecording record_tracker(const std::string& source, const RecordingOptions& options);

/// The same for those who need each tool asked for: throws Error where one never came.
Recording read_source(const std::string& source, const RecordingOptions& options);

/// `read_source`, by a caller that decides what stops it.
using SourceReader =
    std::function<Recording(const std::string& source, const RecordingOptions& options)>;

}  // namespace livetet
