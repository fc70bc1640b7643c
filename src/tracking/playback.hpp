#pragma once

#include <atomic>
#include <optional>
#include <thread>

#include "tracking/source.hpp"

namespace livetet {

struct PlaybackOptions {
    /// Relative to the recording's own pace; none: one sample for each call of `next`.
    std::optional<double> speed = 1;
    /// Delay of each sample after its time stamp, seconds; empty: no delay.
    std::vector<double> delays_s{};
    SampleListener listener{};  ///< called with each sample on the source's thread
};

/// Plays a recording as a tracker source. Playback starts at the first call of `next`.
class Playback : public TrackerSource {
  public:
    /// Throws Error if the recording has no samples, if the speed is not positive, or if the number
    /// of delays differs from the number of samples.
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
    StreamSample taken_;  ///< without a speed: the sample last returned
    std::jthread thread_;
};

}  // namespace livetet
