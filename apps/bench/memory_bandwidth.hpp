#pragma once

#include <cstddef>

namespace livetet {

/// Read bandwidth in bytes/s of this number of threads, on an array of so many bytes: by default
/// one much larger than most caches.
double measure_bandwidth(int threads, std::size_t bytes = 256 << 20);

}  // namespace livetet
