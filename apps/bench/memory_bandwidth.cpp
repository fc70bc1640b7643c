#include "apps/bench/memory_bandwidth.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <chrono>
#include <vector>

#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "base/thread_team.hpp"

namespace livetet {

double measure_bandwidth(int threads) {
    ThreadTeam team(threads);
    const std::vector<double> values(32 << 20, 1.0);
    std::vector<double> sums(threads);
    double best = 1e300;
    for (int k = 0; k < 6; ++k) {
        const auto start = std::chrono::steady_clock::now();
        team.run([&](int t) {
            const std::size_t n = values.size() / threads;
            sums[t] += Eigen::Map<const Eigen::VectorXd>(values.data() + t * n,
                                                         static_cast<Eigen::Index>(n))
                           .sum();
        });
        best = std::min(best, seconds_since(start));
    }
    if (!(sums[0] > 0)) fail("bench: the bandwidth's sum is {}", sums[0]);
    return 8.0 * static_cast<double>(values.size()) / best;
}

}  // namespace livetet
