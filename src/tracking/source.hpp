#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tracking/mailbox.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// When a tool's newest pose was measured and when it came.
struct PoseTimes {
    double sent_s = 0;     ///< the sender's time stamp, seconds since 1970; 0 where it sends none
    double arrived_s = 0;  ///< by this machine's steady clock; 0 where it never came
};

/// The newest of every tool. Of a stream, `sample.time_s` is the sender's newest time stamp (the
/// arrival's, UTC, where it sends none); it never goes backwards, and where the sender's clock is
/// set by more than a second, or turns out to be that far from what samples before the first stamp
/// were dated by, it goes on by the arrivals.
struct StreamSample {
    TrackerSample sample;
    std::vector<PoseTimes> times;
    double arrived_s = 0;      ///< of the message that completed it, steady clock
    std::uint64_t number = 0;  ///< counted from 1 as they come
};
using SampleListener = std::function<void(const StreamSample&)>;

/// Now, by the clock of `arrived_s`.
double steady_seconds();
/// Now, seconds since 1970 (UTC): what a time stamp on the wire is.
double utc_seconds();

/// What a source has met so far.
struct SourceStatus {
    std::string state;    ///< "receiving", "waiting to connect again", ...
    std::string problem;  ///< what ended the last connection or attempt; empty where nothing did
    std::uint64_t samples = 0,
                  refused = 0;  ///< refused: messages that were dropped for what was in them
    std::map<std::string, std::uint64_t>
        names;                            ///< how often each transform came ("StylusToTracker")
    std::vector<std::string> never_came;  ///< tools asked for
    std::string refusal{};                ///< why the last message was refused
};

/// Where tracker samples come from: a server on the network, a recording, a simulated tracker. A
/// thread of its own leaves the newest sample for the one that computes; whoever asks `next` too
/// late misses those in between.
class TrackerSource {
  public:
    virtual ~TrackerSource() = default;

    /// Waits for a sample that was not taken yet; the newest, or nullptr after the last. Stays as
    /// it is until the next call.
    virtual const StreamSample* next();
    /// The same without waiting: nullptr where there is nothing new.
    const StreamSample* take();
    virtual SourceStatus status() const = 0;

    /// The place of a tool in the samples' poses (a tool asked for later than others may be beyond
    /// the end of a sample's poses: it is missing). Throws Error, naming those there are, where
    /// there is none of that name.
    virtual std::size_t index_of(const std::string& tool) = 0;
    /// The tools in the order of the samples' poses.
    virtual std::vector<std::string> tools() const = 0;

  protected:
    /// Numbers the sample, tells the listener and leaves it for `next`; from the source's thread.
    void post(StreamSample sample);
    void post_end();

    SampleListener listener_;
    std::uint64_t posted_ = 0;

  private:
    struct Posted {
        StreamSample sample;
        bool end = false;
    };
    Mailbox<Posted> mailbox_;
};

}  // namespace livetet
