#pragma once

#include "apps/live/tracker_recorder.hpp"
#include "base/progress.hpp"
#include "base/stop_signals.hpp"

namespace livetet {

/// `read_source`, where Ctrl-C ends the reading instead of the program.
inline Recording read_until_signal(const std::string& source, RecordingOptions options) {
    const StopSignals signals;
    options.stop = signals.token();
    ProgressLine line(options.title);
    options.show = line.status();
    return read_source(source, options);
}

}  // namespace livetet
