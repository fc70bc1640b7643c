#pragma once

#include "base/progress.hpp"
#include "base/stop_token.hpp"
#include "io/openigtlink/message.hpp"
#include "io/openigtlink/server.hpp"
#include "tracking/motion_script.hpp"

namespace livetet {

/// Makes the messages that PLUS sends for a sample: a TRANSFORM `StylusToTracker` for each tool,
/// with the status in its metadata. That of a tool that is not seen has header version 2: only
/// clients that read metadata get it. `time_s`: UTC.
std::vector<igtl::Message> sample_messages(const std::vector<std::string>& tools,
                                           const TrackerSample& sample, double time_s);

enum class Repeat { once, until_stopped };

/// Plays a recording as a tracker server would send it, from the moment the first client connects,
/// at its own pace and with its delays. Time stamps are UTC at the time of measurement. Returns at
/// the end of the recording or when `stop` asks for it. Throws Error if the recording is empty.
void serve(OpenIgtLinkServer& server, const DelayedRecording& played, Repeat repeat,
           const StopToken& stop = {}, const StatusCallback& show = {});

}  // namespace livetet
