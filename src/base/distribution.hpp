#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace livetet {

/// Summary of a set of numbers; all zero if it is empty. `worst` is the maximum.
struct Distribution {
    std::size_t count = 0;
    double mean = 0, rms = 0, median = 0, p95 = 0, p99 = 0, worst = 0;
};

/// The p-quantile, p in [0, 1], of `sorted` (ascending, not empty): linear interpolation at index p
/// (n - 1), counted from 0 (Hyndman and Fan 1996, definition 7).
double percentile(std::span<const double> sorted, double p);

/// Summarises `values`, in any order. O(n log n).
Distribution distribution(std::vector<double> values);

}  // namespace livetet
