#include "apps/bench/scaling_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "solvers/parallel/partition.hpp"

namespace livetet {

namespace {

constexpr double tets_a_node = 5.75, coarsest_nodes = 50, neighbours = 12;
constexpr double products_a_visit = 14;  // six smoothing steps before and after, two residuals
constexpr double reductions_an_iteration = 3;
constexpr double most_unknowns_of_metis = 3 * max_tets_of_metis / tets_a_node;

ScalingPoint point_at(const ScalingModel& m, double ranks, double unknowns_a_rank) {
    ScalingPoint p{.ranks = ranks};
    const double nodes = unknowns_a_rank * ranks / 3;
    p.levels = 1 + std::max(0.0, std::floor(std::log(nodes / coarsest_nodes) / std::log(8.0)));
    double here = nodes, visits = 1;
    for (int l = 0; l < static_cast<int>(p.levels); ++l, here /= 8, visits *= 2) {
        const double active = std::clamp(tets_a_node * here / min_tets_per_rank, 1.0, ranks);
        const double each = here / active;
        const double partners = std::min(neighbours, active - 1);
        const double messages = m.messages_factor * products_a_visit * partners;
        const double bytes =
            active > 1 ? m.bytes_factor * products_a_visit * 24 * 6 * std::pow(each, 2.0 / 3) : 0;
        const double exchange = messages * m.latency_s + bytes / m.bytes_a_second;
        // The work of all levels, measured together, is 4/3 of that of the finest.
        const double compute = 0.75 * m.seconds_an_unknown * 3 * each;
        p.messages += visits * messages * active / ranks;
        p.message_bytes += visits * bytes * active / ranks;
        if (active >= ranks) {
            p.compute_s += visits * compute;
            p.halo_s += visits * exchange;
        } else {
            p.coarse_s += visits * (compute + exchange);
        }
    }
    p.reductions_s = reductions_an_iteration * 2 * std::log2(ranks) * m.latency_s;
    const double of_file = unknowns_a_rank * ranks * m.file_share;
    if (ranks > 1 && of_file <= most_unknowns_of_metis)
        p.partition_s = m.partition_s_an_unknown * of_file;
    return p;
}

}  // namespace

ScalingModel::ScalingModel(const SolveRun& timed, const SolveRun& counted, int refine)
    : seconds_an_unknown(timed.linear_s / std::max(1, timed.iterations) /
                         (timed.unknowns / timed.ranks)),
      partition_s_an_unknown(timed.partition_s / timed.unknowns * std::pow(8, refine)),
      file_share(std::pow(8, -refine)),
      counted_ranks(counted.ranks) {
    const ScalingPoint there = point_at(*this, counted.ranks, counted.unknowns / counted.ranks);
    if (counted.messages > 0 && there.messages > 0) {
        const double iterations = static_cast<double>(counted.iterations) * counted.ranks;
        messages_factor = counted.messages / iterations / there.messages;
        bytes_factor = counted.message_bytes / iterations / there.message_bytes;
    }
    for (double ranks = 1; ranks <= 1e5; ranks *= 10)
        points.push_back(point_at(*this, ranks, unknowns_a_rank));
}

void print(const ScalingModel& m) {
    fmt::print(
        "\nmodel of weak scaling, {:.0e} unknowns a rank, {:.1f} us and {:.0f} GB/s a message; "
        "measured here: {:.2f} us an unknown and "
        "iteration, METIS {:.2f} us an unknown of the file's mesh\n",
        m.unknowns_a_rank, 1e6 * m.latency_s, m.bytes_a_second / 1e9, 1e6 * m.seconds_an_unknown,
        1e6 * m.partition_s_an_unknown);
    if (m.counted_ranks > 1)
        fmt::print(
            "messages are scaled to those counted on {} ranks: {:.2f} times as many, {:.2f} times "
            "as many bytes as by surfaces and 12 neighbours\n",
            m.counted_ranks, m.messages_factor, m.bytes_factor);
    fmt::print("{:>8} {:>6} | {:>10} {:>10} {:>13} {:>10} {:>10} {:>10} | {:>10}\n", "ranks",
               "levels", "compute ms", "ghosts ms", "coarse lev. ms", "dots ms", "iteration",
               "efficiency", "METIS, s");
    for (const ScalingPoint& p : m.points)
        fmt::print(
            "{:>8.0f} {:>6.0f} | {:>10.1f} {:>10.2f} {:>14.2f} {:>10.3f} {:>10.1f} {:>9.0f}% | "
            "{:>10}\n",
            p.ranks, p.levels, 1e3 * p.compute_s, 1e3 * p.halo_s, 1e3 * p.coarse_s,
            1e3 * p.reductions_s, 1e3 * p.iteration_s(),
            100 * m.points.front().iteration_s() / p.iteration_s(),
            p.ranks > 1 && p.partition_s == 0 ? "PTScotch" : fmt::format("{:.1f}", p.partition_s));
    fmt::print(
        "What hurts first: the coarse levels, which few ranks have work for: they are on as few as "
        "that ({} tets each), visited ever more often.\nThe file's mesh is read in parts. METIS "
        "partitions it on one rank, up to {} tets; beyond, PTScotch does on all, for a time that "
        "is not modelled.\n",
        min_tets_per_rank, max_tets_of_metis);
}

nlohmann::json json_of(const ScalingModel& m) {
    nlohmann::json points = nlohmann::json::array();
    for (const ScalingPoint& p : m.points)
        points.push_back({{"ranks", p.ranks},
                          {"levels", p.levels},
                          {"compute_s", p.compute_s},
                          {"halo_s", p.halo_s},
                          {"coarse_s", p.coarse_s},
                          {"reductions_s", p.reductions_s},
                          {"messages", p.messages},
                          {"message_bytes", p.message_bytes},
                          {"partition_s", p.partition_s}});
    return {{"unknowns_a_rank", m.unknowns_a_rank},
            {"latency_s", m.latency_s},
            {"bytes_a_second", m.bytes_a_second},
            {"seconds_an_unknown", m.seconds_an_unknown},
            {"partition_s_an_unknown", m.partition_s_an_unknown},
            {"file_share", m.file_share},
            {"counted_ranks", m.counted_ranks},
            {"messages_factor", m.messages_factor},
            {"bytes_factor", m.bytes_factor},
            {"points", points}};
}

#ifdef LIVETET_IMAGES
std::vector<WorkPrecisionLine> lines_of(const ScalingModel& m) {
    std::vector<WorkPrecisionLine> lines;
    const auto add = [&](const std::string& name, auto&& value) {
        WorkPrecisionLine line{name, {}, {}};
        for (const ScalingPoint& p : m.points)
            if (const double s = value(p); s > 0) {
                line.seconds.push_back(p.ranks);
                line.error.push_back(s);
            }
        lines.push_back(std::move(line));
    };
    add("iteration", [](const ScalingPoint& p) { return p.iteration_s(); });
    add("compute", [](const ScalingPoint& p) { return p.compute_s; });
    add("ghosts' values", [](const ScalingPoint& p) { return p.halo_s; });
    add("coarse levels", [](const ScalingPoint& p) { return p.coarse_s; });
    add("dot products", [](const ScalingPoint& p) { return p.reductions_s; });
    return lines;
}
#endif

}  // namespace livetet
