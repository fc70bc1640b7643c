#include "tracking/playback.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "tracking/poses.hpp"

namespace livetet {

Playback::Playback(Recording recording, PlaybackOptions options)
    : recording_(std::move(recording)), options_(std::move(options)) {
    if (recording_.samples.empty()) fail("playback: the recording has no samples");
    if (options_.speed && !(*options_.speed > 0))
        fail("playback: speed = {} must be > 0", *options_.speed);
    if (!options_.delays_s.empty() && options_.delays_s.size() != recording_.samples.size())
        fail("playback: {} delays for {} samples", options_.delays_s.size(),
             recording_.samples.size());
    listener_ = options_.listener;
}

Playback::~Playback() = default;

StreamSample Playback::sample(std::size_t i) const {
    const TrackerSample& s = recording_.samples[i];
    const double now = steady_seconds();
    return {s, std::vector<PoseTimes>(s.poses.size(), {s.time_s, now}), now, i + 1};
}

const StreamSample* Playback::next() {
    if (options_.speed) {
        if (!thread_.joinable())
            thread_ = std::jthread([this](const std::stop_token& stop) { play(stop); });
        return TrackerSource::next();
    }
    if (played_ == recording_.samples.size()) return nullptr;
    taken_ = sample(played_++);
    if (listener_) listener_(taken_);
    return &taken_;
}

void Playback::play(const std::stop_token& stop) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any sleep;
    const auto start = std::chrono::steady_clock::now();
    const double first = recording_.samples.front().time_s;
    const auto until = [&](double seconds) {  // returns at once if playback is stopped
        const std::chrono::duration<double> way(seconds / *options_.speed);
        sleep.wait_until(
            lock, stop,
            start + std::chrono::duration_cast<std::chrono::steady_clock::duration>(way),
            [] { return false; });
    };
    const auto comes = [&](std::size_t i) {
        return recording_.samples[i].time_s - first +
               (options_.delays_s.empty() ? 0 : options_.delays_s[i]);
    };
    double last = 0;
    for (std::size_t i = 0; i < recording_.samples.size(); ++i) {
        last = std::max(last, comes(i));  // samples keep their order
        until(last);
        if (stop.stop_requested()) return;
        post(sample(i));
        played_ = i + 1;
    }
    until(last + 0.2);  // gives the consumer time to take the last sample
    post_end();
}

SourceStatus Playback::status() const {
    SourceStatus status;
    status.samples = played_;
    status.state = status.samples < recording_.samples.size() ? "playing" : "at its end";
    return status;
}

std::size_t Playback::index_of(const std::string& tool) { return tool_index(recording_, tool); }

}  // namespace livetet
