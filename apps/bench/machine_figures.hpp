#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <vector>

namespace livetet {

/// Read bandwidth of an array.
struct BandwidthFigure {
    std::size_t bytes;
    int threads;
    double bytes_per_s;
};

/// What a machine does at most, for times of two machines to be compared by.
struct MachineFigures {
    int threads = 1;
    double tets_per_s = 0;                    ///< of the corotated kernel, on one core
    double kernel_bytes_per_s = 0;            ///< what it moves
    std::vector<BandwidthFigure> bandwidths;  ///< of one core, then of `threads`

    /// Of all threads on the largest array, bytes/s.
    double bandwidth() const { return bandwidths.back().bytes_per_s; }
};

/// Measures in about three seconds. The kernel: rotations and forces of 62,208 corotated four-node
/// tets in float, as a frame of the live solver begins. Bandwidths: at 25 MB, which many caches
/// hold, and at 1 GB, which none does; the latter only on a machine of at least 4 GB.
MachineFigures measure_machine(int threads);

void print_machine(const MachineFigures& machine);
nlohmann::json json_of(const MachineFigures& machine);

}  // namespace livetet
