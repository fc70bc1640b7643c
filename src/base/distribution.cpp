#include "base/distribution.hpp"

#include <algorithm>
#include <cmath>

namespace livetet {

double percentile(std::span<const double> sorted, double p) {
    const double place = p * static_cast<double>(sorted.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, sorted.size() - 1);
    return std::lerp(sorted[below], sorted[above], place - static_cast<double>(below));
}

Distribution distribution(std::vector<double> values) {
    Distribution d;
    if (values.empty()) return d;
    std::sort(values.begin(), values.end());
    const auto n = static_cast<double>(values.size());
    for (const double v : values) {
        d.mean += v / n;
        d.rms += v * v / n;
    }
    d.count = values.size();
    d.rms = std::sqrt(d.rms);
    d.median = percentile(values, 0.5);
    d.p95 = percentile(values, 0.95);
    d.p99 = percentile(values, 0.99);
    d.worst = values.back();
    return d;
}

}  // namespace livetet
