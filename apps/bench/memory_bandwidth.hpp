#pragma once

namespace livetet {

/// Bytes a second that a team of so many threads reads from memory, far more than caches hold.
double measure_bandwidth(int threads);

}  // namespace livetet
