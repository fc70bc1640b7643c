#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracking/motion_script.hpp"
#include "tracking/source.hpp"

namespace livetet {

struct SourceOptions {
    /// Of a recording, relative to its own pace; none: every sample, one after the other.
    std::optional<double> speed = 1;
    SampleListener listener{};        ///< called with each sample by the source's thread
    std::optional<int> request_ms{};  ///< of a stream: interval of TDATA requests
    std::string names_tools{};        ///< for errors, behind the source: what names the tools
};

struct OpenSource {
    std::unique_ptr<TrackerSource> source;
    std::size_t samples = 0;  ///< number of samples; 0: unknown
    double interval_s = 0;    ///< typical sampling interval; 0: unknown

    bool is_streaming() const { return samples == 0; }
};

/// Whether this names a stream (openigtlink://host:port), not a file.
bool is_stream(const std::string& name);

/// Reads a recording, or runs the script (.yaml, .yml) of a simulated tracker. Throws Error if the
/// file is invalid.
DelayedRecording read_stored(const std::string& name);

/// The median sampling interval of a recording, s; 0 if it has fewer than two samples.
double sample_interval(const Recording& recording);

/// The names of the received transforms, separated by commas; empty if there are none.
std::string names_text(const SourceStatus& status);

/// Rate of a counter over the last second, 1/s.
class Rate {
  public:
    double operator()(std::uint64_t count);

  private:
    std::uint64_t marked_ = 0;
    double marked_s_ = steady_seconds(), rate_Hz_ = 0;
};

/// Opens a tracker source: openigtlink://host:port, a recording, or the script of a simulated
/// tracker. `tools`: those requested from a stream. Throws Error if the name or the file is
/// invalid, or a recording lacks a tool.
OpenSource open_source(const std::string& name, const std::vector<std::string>& tools,
                       const SourceOptions& options);

}  // namespace livetet
