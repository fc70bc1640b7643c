#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/bench/core_watch.hpp"
#include "mesh/tet_mesh.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// A timed frame, and its distance from the converged one.
struct Measured {
    double seconds = 0;
    CoreUse cores;
    StepReport step;
    double sensor_s = 0, output_s = 0;
    double largest = 0;  ///< largest displacement of the converged frame, m
    double error = -1,
           node_error = 0;            ///< RMS over the nodes, and worst node, m; -1: not computed
    bool reference_converged = true;  ///< reference of the errors
};

/// What a case must reach. Errors are RMS over the nodes, relative to the largest displacement.
struct RealtimeTarget {
    double rate = 0;  ///< frames a second
    double mean_error = 0, worst_error = 0;
};

/// The least that a frame moves from and to memory, bytes, by stage: each array once for each use.
struct FrameBytes {
    double forces = 0, operators = 0, solve = 0;

    double total() const { return forces + operators + solve; }
};

/// Times and errors of the frames of a case.
struct RealtimeResult {
    std::string name, motion;
    double nu = 0;
    std::size_t tets = 0, nodes = 0;
    int threads = 1;
    bool is_beam = false;
    RealtimeTarget target;
    FrameTimes times;
    double error_mean = 0, error_worst = 0,
           estimate_mean = 0;  ///< RMS over the nodes, relative to the largest displacement
    double node_error_mean = 0,
           node_error_worst = 0;  ///< worst node, relative to the largest displacement
    double cycles_mean = 0;
    std::size_t cut_short = 0, half_renewed = 0;
    std::size_t references_not_converged = 0;
    std::uint64_t allocations = 0;
    FrameBytes bytes;
    double bandwidth = 0;
    nlohmann::json stages;
    nlohmann::json jump;

    double rate() const { return 1 / times.all.p99; }
    /// Target rates hold at the 99th percentile; for a beam's step, which no tracker waits for, at
    /// the median.
    bool in_time() const { return 1 / (is_beam ? times.all.median : times.all.p99) >= target.rate; }
    /// Whether the frames that had their cores hold the target rate.
    bool in_time_with_cores() const {
        const Distribution& d = times.with_cores;
        return times.can_judge_with_cores() && 1 / (is_beam ? d.median : d.p99) >= target.rate;
    }
    /// After a jump: all frames are finite, and the tenth is within the bound of the worst. A beam
    /// does not jump.
    bool settles() const {
        return jump.is_null() || (jump.at("finite").get<bool>() &&
                                  jump.at("error").back().get<double>() <= target.worst_error);
    }
    /// A rate that a noisy hour breaks counts as held where the frames with their cores hold it.
    bool meets_target() const {
        return (in_time() || in_time_with_cores()) && error_mean <= target.mean_error &&
               error_worst <= target.worst_error && allocations == 0 && times.blocked == 0 &&
               settles();
    }
};

FrameBytes bytes_of_frame(const DeformableBody& body, std::size_t tets, std::size_t nodes,
                          double iterations, TimeScheme scheme);

/// Difference of displacements, and the largest of `b`, m.
struct Gap {
    double rms = 0, node = 0, largest = 0;
};
Gap gap_between(const std::vector<Vector3>& a, const std::vector<Vector3>& b);

/// Enters times and stages, and errors of the judged frames, into the result.
void take_times(RealtimeResult& result, const std::vector<Measured>& frames);
void take_errors(RealtimeResult& result, const std::vector<Measured>& frames);

nlohmann::json json_of(const RealtimeResult& result);
void print_realtime_header();
void print_row(const RealtimeResult& result);

}  // namespace livetet
