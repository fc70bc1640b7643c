#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tracking/mailbox.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// Times of a tool's newest pose.
struct PoseTimes {
    double sent_s = 0;  ///< the sender's time stamp, seconds since 1970; 0 without a time stamp
    double arrived_s =
        0;  ///< arrival by this machine's steady clock; 0 if the tool was never reported
};

/// The newest pose of every tool. In a stream, `sample.time_s` is the sender's newest time stamp,
/// or the arrival time (UTC) if the sender sends none. It never decreases: if the sender's clock is
/// set by more than a second, or its first stamp differs by more than a second from earlier samples
/// dated by arrival, time continues by arrival times.
struct StreamSample {
    TrackerSample sample;
    std::vector<PoseTimes> times;
    double arrived_s = 0;      ///< arrival of the message that completed the sample, steady clock
    std::uint64_t number = 0;  ///< sequence number, from 1
};
/// Of TrackerSource::passed: more than a second at the rates of electromagnetic trackers.
inline constexpr std::size_t max_passed = 64;
using SampleListener = std::function<void(const StreamSample&)>;

/// Current time of the clock of `arrived_s`.
double steady_seconds();
/// Current UTC time, seconds since 1970; the time base of time stamps on the wire.
double utc_seconds();

/// State and counters of a source.
struct SourceStatus {
    std::string state;    ///< "receiving", "waiting to connect again", ...
    std::string problem;  ///< why the last connection or attempt ended; empty if none did
    std::uint64_t samples = 0;
    std::uint64_t refused = 0;  ///< messages dropped because of their content
    /// Number of messages for each transform name ("StylusToTracker").
    std::map<std::string, std::uint64_t> names;
    std::vector<std::string> never_came;  ///< requested tools that were never reported
    std::string refusal{};                ///< why the last message was dropped
};

/// A source of tracker samples: a server on the network, a recording or a simulated tracker. The
/// source's own thread leaves the newest sample in a mailbox; a consumer that calls `next` late
/// skips the samples in between, of which `passed` has the newest.
class TrackerSource {
  public:
    virtual ~TrackerSource() = default;

    /// Waits for a sample not yet taken and returns the newest, or nullptr after the last one. The
    /// sample is valid until the next call.
    virtual const StreamSample* next();
    /// Like `next`, but returns nullptr at once if there is no new sample.
    const StreamSample* take();
    /// The samples that were skipped before the one that `next` or `take` returned last, oldest
    /// first; the newest max_passed at most. Valid as long as that one.
    std::span<const TrackerSample> passed() const;
    /// Whether `next` would return at once.
    bool has_next() const { return mailbox_.has_new(); }
    virtual SourceStatus status() const = 0;

    /// Index of a tool in the samples' poses. The index of a tool requested later may be beyond the
    /// end of an earlier sample's poses; the tool is then missing. Throws Error, listing the
    /// existing tools, if there is none of that name.
    virtual std::size_t index_of(const std::string& tool) = 0;
    /// The tools in the order of the samples' poses.
    virtual std::vector<std::string> tools() const = 0;

  protected:
    /// Called by the source's thread: numbers the sample, calls the listener and posts the sample
    /// to `next`.
    void post(StreamSample sample);
    void post_end();

    SampleListener listener_;
    std::uint64_t posted_ = 0;

  private:
    struct Posted {
        StreamSample sample;
        std::vector<TrackerSample> passed;
        bool end = false;
    };
    bool take_newest();

    Mailbox<Posted> mailbox_;
    // The source's thread:
    std::vector<TrackerSample> passed_;  ///< posted and, as far as is known, not taken
    TrackerSample newest_;               ///< posted last
    // The consumer's:
    std::uint64_t taken_ = 0, taken_before_ = 0;  ///< numbers of the last two samples taken
};

}  // namespace livetet
