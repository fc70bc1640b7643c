#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracking/source.hpp"

namespace livetet {

struct OpenIgtLinkSourceOptions {
    double gather_s =
        0.005;  ///< at most so long does a sample wait for the tools missing at its time stamp
    double stale_after_s = 0.25;  ///< a tool that has not come for so long is missing
    double silence_after_s =
        1;  ///< a connection on which no message came for so long is called silent
    double first_retry_s = 0.1;  ///< pause before connecting again, doubled each time
    double max_retry_s = 2;
    double connect_timeout_s = 3;
    std::optional<int> request_ms{};  ///< asks for tracking data (STT_TDATA) that often, for
                                      ///< servers that wait for it
    SampleListener listener{};        ///< called with each sample by the source's thread
};

/// What a source has met so far.
struct OpenIgtLinkStatistics {
    enum class State { connecting, receiving, silent, waiting };
    State state = State::connecting;  ///< waiting: before it connects again
    std::string problem;  ///< what ended the last connection or attempt; empty where nothing did
    std::uint64_t messages = 0, samples = 0;  ///< samples for which a tool came
    std::uint64_t bad_crc = 0, malformed = 0,
                  passed_over = 0;  ///< messages dropped; of types not used
    std::string last_error;         ///< why the last message was dropped
    std::uint64_t connections = 0;  ///< the first and every one after it
    std::map<std::string, std::uint64_t>
        names;  ///< how often each transform came ("StylusToTracker"); at most 256
    std::vector<std::string> never_came;  ///< tools asked for
    double last_arrival_s = 0;            ///< steady clock; 0 for none
};

std::string_view to_text(OpenIgtLinkStatistics::State state);

/// Follows a tracker server (PLUS and its kin) by OpenIGTLink from a thread of its own: TRANSFORM,
/// POSITION (QTRANS), TDATA and QTDATA of header versions 1 to 3. Connects, and connects again with
/// growing pauses, for as long as it lives. On connecting it sends a STATUS of version 2, without
/// which PLUS sends no metadata.
///
/// Names: `StylusToTracker`, or just `Stylus`, is the tool "Stylus"; a name of 20 bytes stands for
/// the one tool whose name is cut to it. Others are counted by name. A pose whose metadata say it
/// is not OK has the status that they say, one whose matrix is not finite or not rigid is broken,
/// and its last numbers are kept out of samples.
///
/// How messages become samples: a sample holds the newest pose of every tool. It is posted as soon
/// as every tool that is alive has come with the same time stamp, so that nothing waits when a
/// frame's messages come one after another and no sample mixes two moments; a tool that is left out
/// costs the others at most `gather_s`. A tool that is no longer in its device's TDATA is missing
/// at once. While no tool comes, whatever else does, samples in which every tool is missing are
/// posted from `stale_after_s` on: every 50 ms at first, every 0.5 s in the end. So whoever waits
/// for one wakes up, and lets go of what a tool held little by little.
///
/// A tool that came, but not for `stale_after_s`, is stale. A time stamp that stands for so long
/// counts as none; where those of other tools go on, the tool is stale.
class OpenIgtLinkSource : public TrackerSource {
  public:
    /// Poses come in the order of `tools`. Throws Error where two tools cannot be told apart, or an
    /// option is not positive. Does not wait for the server, which may not be there yet.
    OpenIgtLinkSource(std::string host, std::uint16_t port, std::vector<std::string> tools,
                      OpenIgtLinkSourceOptions options = {});
    ~OpenIgtLinkSource() override;

    OpenIgtLinkStatistics statistics() const;
    SourceStatus status() const override;
    /// A tool that is not followed yet is from now on, its poses behind those of the others.
    std::size_t index_of(const std::string& tool) override;
    std::vector<std::string> tools() const override { return tools_; }

  private:
    class Connector;
    std::vector<std::string> tools_;
    std::unique_ptr<Connector> connector_;
};

}  // namespace livetet
