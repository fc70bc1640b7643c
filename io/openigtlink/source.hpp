#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracking/source.hpp"

namespace livetet {

/// Options of an OpenIgtLinkSource.
struct OpenIgtLinkSourceOptions {
    /// Longest time that a sample waits for tools missing at its time stamp.
    double gather_s = 0.005;
    double stale_after_s = 0.25;  ///< a tool not reported for this long is stale
    /// A connection without messages for this long is reported as silent.
    double silence_after_s = 1;
    /// A connection without messages for this long is closed and made anew.
    double hang_up_after_s = 5;
    double first_retry_s = 0.1;  ///< pause before the first reconnection, doubled each time
    double max_retry_s = 2;
    double connect_timeout_s = 3;
    /// Requests tracking data (STT_TDATA) at this interval, for servers that wait for a request.
    std::optional<int> request_ms{};
    SampleListener listener{};  ///< called with each sample on the source's thread
};

/// State and counters of an OpenIGTLink source.
struct OpenIgtLinkStatistics {
    enum class State { connecting, receiving, silent, waiting };
    State state = State::connecting;  ///< `waiting`: pausing before reconnecting
    std::string problem;  ///< why the last connection or attempt ended; empty if none did
    std::uint64_t messages = 0,
                  samples = 0;  ///< `samples`: samples that a tool's message completed
    std::uint64_t bad_crc = 0, malformed = 0;  ///< messages dropped
    std::uint64_t ambiguous = 0;    ///< poses dropped: several tools have the name, cut to 20 bytes
    std::uint64_t passed_over = 0;  ///< messages of types that are not used
    std::string last_error;         ///< why the last message was dropped
    std::uint64_t connections = 0;  ///< connections made so far
    /// Number of messages for each transform name ("StylusToTracker"); at most 256 names.
    std::map<std::string, std::uint64_t> names;
    std::vector<std::string> never_came;  ///< requested tools that were never reported
    double last_arrival_s = 0;            ///< arrival of the last message, steady clock; 0 for none
};

/// The state in words, for messages.
std::string_view to_text(OpenIgtLinkStatistics::State state);

/// Receives poses from a tracker server (such as PLUS) by OpenIGTLink on its own thread: TRANSFORM,
/// POSITION (QTRANS), TDATA and QTDATA of header versions 1 to 3. Connects, and reconnects with
/// growing pauses, during its whole lifetime. On connecting it sends a STATUS of version 2, without
/// which PLUS sends no metadata.
///
/// Names: `StylusToTracker` or `Stylus` is the tool "Stylus"; a name of 20 bytes matches the one
/// tool whose name is cut to it. If several may be cut to it, or if two poses of one moment come
/// under it, its poses are dropped. Other names are counted. A pose with a status other than OK in
/// its metadata takes that status; a matrix that is not finite or not rigid makes the pose broken.
/// The numbers of such poses do not appear in samples.
///
/// Samples: a sample has the newest pose of every tool. It is posted as soon as every active tool
/// has been reported with the same time stamp. So nothing waits when a frame's messages arrive one
/// after another, and no sample mixes two moments. A missing tool delays the others by at most
/// `gather_s`. A tool that is no longer in its device's TDATA is missing at once. While no tool is
/// reported, samples with all tools missing are posted from `stale_after_s` on, every 50 ms at
/// first and every 0.5 s in the end, so that a waiting consumer wakes up and can release the
/// patches gradually.
///
/// A tool not reported for `stale_after_s` is stale. A pose with the tool's last time stamp is no
/// new report: a hung server may send it again and again. (A stamp of 0 means none.)
class OpenIgtLinkSource : public TrackerSource {
  public:
    /// Poses are in the order of `tools`. Throws Error if two tools have one name or an
    /// option is not positive. Does not wait for the server, which may start later.
    OpenIgtLinkSource(std::string host, std::uint16_t port, std::vector<std::string> tools,
                      OpenIgtLinkSourceOptions options = {});
    ~OpenIgtLinkSource() override;

    OpenIgtLinkStatistics statistics() const;
    SourceStatus status() const override;
    /// The index of a tool. A new tool is followed from now on, after the others.
    std::size_t index_of(const std::string& tool) override;
    std::vector<std::string> tools() const override { return tools_; }

  private:
    class Connector;
    std::vector<std::string> tools_;
    std::unique_ptr<Connector> connector_;
};

}  // namespace livetet
