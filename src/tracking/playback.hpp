#pragma once

#include <atomic>
#include <thread>

#include "tracking/source.hpp"

namespace livetet {

struct PlaybackOptions {
    double speed = 1;  ///< times its own pace; 0: frame by frame, none is missed
    std::vector<double>
        delays_s{};             ///< how long after its time each sample comes; none: at its time
    SampleListener listener{};  ///< called with each sample, by the thread that posts it
};

/// A recording as a source. It begins when `next` is first called.
class Playback : public TrackerSource {
  public:
    /// Throws Error for a recording without samples, a speed that is negative, and delays that are
    /// not as many as samples.
    explicit Playback(Recording recording, PlaybackOptions options = {});
    ~Playback() override;

    const StreamSample* next() override;
    SourceStatus status() const override;
    std::size_t index_of(const std::string& tool) override;
    std::vector<std::string> tools() const override { return recording_.tools; }
    std::size_t sample_count() const { return recording_.samples.size(); }

  private:
    void play(const std::stop_token& stop);
    StreamSample sample(std::size_t i) const;

    const Recording recording_;
    PlaybackOptions options_;
    std::atomic<std::uint64_t> played_{0};
    StreamSample taken_;  // frame by frame
    std::jthread thread_;
};

}  // namespace livetet
