#pragma once

#include <filesystem>

namespace livetet {

struct LatencyArguments {
    double seconds = 30;
    double rate_Hz = 40;  ///< of the tracker
    int tets = 60000;
    double budget_ms = 10;
    std::filesystem::path json;
};

/// From a tracker's message to the published frame that used it: a tracker server, `track`'s own
/// frame loop with its recorder and its server, and a client that reads every frame, all over TCP
/// on this machine. Prints a table; returns the exit status: 0, or 1 where the median is above 15
/// ms or the 99th percentile above 25 ms.
int bench_latency(const LatencyArguments& arguments);

}  // namespace livetet
