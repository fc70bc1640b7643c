#include "apps/bench/memory_bandwidth.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <chrono>
#include <memory>
#include <vector>

#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "base/thread_team.hpp"

namespace livetet {

double measure_bandwidth(int threads, std::size_t bytes) {
    ThreadTeam team(threads);
    const std::size_t n = bytes / sizeof(double) / threads;  // of each thread
    const auto values = std::make_unique_for_overwrite<double[]>(n * threads);
    // A thread's pages are placed near the core that writes them first.
    team.run([&](int t) { std::fill_n(values.get() + t * n, n, 1.0); });
    std::vector<double> sums(8 * threads);  // a cache line for each
    // Enough passes for the best one to be free of what else the machine does.
    const auto passes = std::clamp<std::size_t>((std::size_t{2} << 30) / bytes, 6, 60);
    double best = 1e300;
    for (std::size_t k = 0; k < passes; ++k) {
        const auto start = std::chrono::steady_clock::now();
        team.run([&](int t) {
            sums[8 * t] += Eigen::Map<const Eigen::VectorXd>(values.get() + t * n,
                                                             static_cast<Eigen::Index>(n))
                               .sum();
        });
        best = std::min(best, seconds_since(start));
    }
    if (!(sums[0] > 0)) fail("bench: the bandwidth's sum is {}", sums[0]);
    return static_cast<double>(sizeof(double) * n * threads) / best;
}

}  // namespace livetet
