#pragma once

namespace livetet {

/// Read bandwidth in bytes/s of this number of threads, on an array much larger than the caches.
double measure_bandwidth(int threads);

}  // namespace livetet
