#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/distribution.hpp"
#include "mesh/tet_mesh.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// One frame, timed, and how far it was from the converged one.
struct Measured {
    double seconds = 0;
    StepReport step;
    double sensor_s = 0, output_s = 0;
    double largest = 0;  ///< displacement of the converged frame, m
    double error = -1,
           node_error = 0;  ///< RMS over the nodes, and at the worst one, m; -1: not looked at
    bool reference_converged = true;  ///< what the errors are measured against
};

struct RealtimeResult {
    std::string name, motion;
    double nu = 0;
    std::size_t tets = 0, nodes = 0;
    int threads = 1;
    bool is_beam = false;
    double rate_asked = 0, mean_allowed = 0, worst_allowed = 0;
    Distribution seconds;
    double error_mean = 0, error_worst = 0,
           estimate_mean = 0;  ///< RMS over the nodes, of the largest displacement
    double node_error_mean = 0,
           node_error_worst = 0;  ///< at the worst node, of the largest displacement
    double cycles_mean = 0;
    std::size_t cut_short = 0, half_renewed = 0, frames = 0;
    std::size_t references_not_converged = 0;
    std::uint64_t allocations = 0;
    long blocked = 0;  ///< times that the simulation thread gave up its core of itself
    double bytes = 0;  ///< of a frame
    double bandwidth = 0;
    nlohmann::json stages;
    nlohmann::json jump;

    double rate() const { return 1 / seconds.p99; }
    /// Rates are asked for at the 99th percentile; of a beam's step, which no tracker waits for,
    /// the median.
    bool in_time() const { return 1 / (is_beam ? seconds.median : seconds.p99) >= rate_asked; }
    /// After a jump within a frame: all frames finite, and within the worst bound by the tenth. A
    /// beam does not jump.
    bool settles() const {
        return jump.is_null() || (jump.at("finite").get<bool>() &&
                                  jump.at("error").back().get<double>() <= worst_allowed);
    }
    bool held() const {
        return in_time() && error_mean <= mean_allowed && error_worst <= worst_allowed &&
               allocations == 0 && blocked == 0 && settles();
    }
};

/// How often the calling thread gave up its core of itself.
long times_blocked();

/// What a frame has to move at least: every array once where it is used.
double bytes_of_frame(DeformableBody& body, std::size_t tets, std::size_t nodes, double iterations,
                      bool dynamic);

/// How far displacements are apart, and the largest of `b`, m.
struct Gap {
    double rms = 0, node = 0, largest = 0;
};
Gap gap_between(const std::vector<Vector3>& a, const std::vector<Vector3>& b);

/// Into the result: times and stages; errors of the frames that were judged.
void take_times(RealtimeResult& result, const std::vector<Measured>& frames);
void take_errors(RealtimeResult& result, const std::vector<Measured>& frames);

nlohmann::json json_of(const RealtimeResult& result);
void print_realtime_header();
void print_row(const RealtimeResult& result);

}  // namespace livetet
