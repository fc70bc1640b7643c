#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracking/motion_script.hpp"
#include "tracking/source.hpp"

namespace livetet {

struct SourceOptions {
    double speed = 1;  ///< of a recording: times its own pace; 0: every sample, one after the other
    SampleListener listener{};  ///< called with each sample that comes, by the source's thread
    std::optional<int> request_ms{};  ///< of a stream: asks for TDATA so often
};

struct OpenSource {
    std::unique_ptr<TrackerSource> source;
    std::size_t samples = 0;  ///< how many there will be; 0: nobody knows
    double interval_s = 0;    ///< typical time between them; 0: nobody knows

    bool is_streaming() const { return samples == 0; }
};

/// Whether a source is one that others send (openigtlink://host:port), else it is a file.
bool is_stream(const std::string& name);

/// A recording, or what a simulated tracker's script (.yaml, .yml) makes, whole. Throws Error where
/// the file is not good.
DelayedRecording read_stored(const std::string& name);

/// The typical time between a recording's samples, s; 0 where it has less than two.
double sample_interval(const Recording& recording);

/// The names of the transforms that came, one behind the other; empty where none did.
std::string names_text(const SourceStatus& status);

/// How many a second: of what was counted over the last second.
class Rate {
  public:
    double operator()(std::uint64_t count);

  private:
    std::uint64_t marked_ = 0;
    double marked_s_ = steady_seconds(), rate_Hz_ = 0;
};

/// Opens what `track.source` and its kin name: openigtlink://host:port, a recording, a simulated
/// tracker's script. `tools`: those wanted of a stream. Throws Error where the name or the file is
/// not good, or a recording lacks a tool.
OpenSource open_source(const std::string& name, const std::vector<std::string>& tools,
                       const SourceOptions& options);

}  // namespace livetet
