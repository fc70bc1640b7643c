#pragma once

#include "base/stop_token.hpp"
#include "io/openigtlink/message.hpp"
#include "io/openigtlink/server.hpp"
#include "tracking/motion_script.hpp"

namespace livetet {

/// A sample as PLUS sends it: a TRANSFORM `StylusToTracker` for each tool, the status in its
/// metadata. One of a tool that is not seen goes to those clients alone who read metadata (header
/// version 2). `time_s`: UTC.
std::vector<igtl::Message> sample_messages(const std::vector<std::string>& tools,
                                           const TrackerSample& sample, double time_s);

enum class Repeat { once, until_stopped };

/// Plays a recording as a tracker server would send it, from the moment the first client connects,
/// at its own pace and with its delays; a sample's time stamp is the wall clock's when it would
/// have been measured. Returns at the recording's end or where `stop` asks for it, with a status
/// line while it runs. Throws Error where the recording has no samples.
void serve(OpenIgtLinkServer& server, const DelayedRecording& played, Repeat repeat,
           const StopToken& stop = {});

}  // namespace livetet
