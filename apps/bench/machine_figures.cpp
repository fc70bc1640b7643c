#include "apps/bench/machine_figures.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <set>

#include "apps/bench/memory_bandwidth.hpp"
#include "apps/verification/meshes.hpp"
#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "mechanics/batch_kernels.hpp"

namespace livetet {

namespace {

constexpr std::size_t cached_bytes = 25'000'000, uncached_bytes = 1'000'000'000;
constexpr double least_memory_for_uncached = 4e9;

double memory_of_machine() {
    return static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
           static_cast<double>(::sysconf(_SC_PAGESIZE));
}

/// Corotated tets of a block that is bent by a quarter turn. Bytes: each array once, forces twice.
void measure_kernel(MachineFigures& machine) {
    const TetMesh mesh = verification::box({0.16, 0.09, 0.09}, {32, 18, 18});
    std::vector<TetElement> elements;
    for (const Tet& t : mesh.tets)
        elements.push_back(make_element(
            {mesh.nodes[t[0]], mesh.nodes[t[1]], mesh.nodes[t[2]], mesh.nodes[t[3]]}, 9000, 1000));
    const TetBatches<float> batches([&](std::size_t e) { return elements[e]; }, mesh.tets);
    std::vector<RotationBatch<float>> rotations = batches.make_rotations();
    std::vector<float> u;
    for (const Vector3& x : mesh.nodes)
        for (const double component : {0.1 * x.y() * x.z(), -x.y() * x.x(), 5 * x.x() * x.x()})
            u.push_back(static_cast<float>(component));
    u.push_back(0);  // the kernels read one number behind the last node
    std::vector<float> f(u.size());
    double best = 1e300;
    for (int k = 0; k < 50; ++k) {
        std::fill(f.begin(), f.end(), 0.0F);
        const auto start = std::chrono::steady_clock::now();
        update_rotations<float>(batches, batches.all(), u, rotations);
        add_forces<float>(batches, batches.all(), rotations, u, f);
        best = std::min(best, seconds_since(start));
    }
    double squares = 0;
    for (const float x : f) squares += x * x;
    if (!(squares > 0)) fail("bench: the kernel's forces have the square {}", squares);
    const double batch_count = static_cast<double>(batches.all().end);
    const double bytes =
        2 * batch_count * (sizeof(TetBatch<float>) + sizeof(RotationBatch<float>)) +
        4.0 * sizeof(float) * static_cast<double>(u.size());
    machine.tets_per_s = static_cast<double>(mesh.tets.size()) / best;
    machine.kernel_bytes_per_s = bytes / best;
}

}  // namespace

MachineFigures measure_machine(int threads) {
    MachineFigures machine;
    machine.threads = threads;
    measure_kernel(machine);
    std::vector<std::size_t> sizes{cached_bytes};
    if (memory_of_machine() >= least_memory_for_uncached) sizes.push_back(uncached_bytes);
    for (const int t : std::set<int>{1, threads})
        for (const std::size_t bytes : sizes)
            machine.bandwidths.push_back({bytes, t, measure_bandwidth(t, bytes)});
    return machine;
}

void print_machine(const MachineFigures& machine) {
    fmt::print("kernel, one core: {:.1f} million tets/s, {:.1f} GB/s\n", machine.tets_per_s / 1e6,
               machine.kernel_bytes_per_s / 1e9);
    for (const BandwidthFigure& b : machine.bandwidths)
        fmt::print("memory bandwidth, {:<8} {:>4.0f} MB: {:>6.1f} GB/s\n",
                   fmt::format("{} core{},", b.threads, b.threads == 1 ? "" : "s"),
                   static_cast<double>(b.bytes) / 1e6, b.bytes_per_s / 1e9);
    fmt::print("\n");
}

nlohmann::json json_of(const MachineFigures& machine) {
    nlohmann::json bandwidths = nlohmann::json::array();
    for (const BandwidthFigure& b : machine.bandwidths)
        bandwidths.push_back(
            {{"bytes", b.bytes}, {"threads", b.threads}, {"bytes_per_s", b.bytes_per_s}});
    return {{"threads", machine.threads},
            {"kernel_tets_per_s", machine.tets_per_s},
            {"kernel_bytes_per_s", machine.kernel_bytes_per_s},
            {"bandwidths", bandwidths}};
}

}  // namespace livetet
