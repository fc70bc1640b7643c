#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "apps/bench/solve_run.hpp"
#ifdef LIVETET_IMAGES
#include "apps/plots/pictures.hpp"
#endif

namespace livetet {

/// What one iteration, and getting there, would take on so many ranks of `unknowns_a_rank` each.
struct ScalingPoint {
    double ranks = 1, levels = 1;
    double compute_s = 0;         ///< of an iteration, on the finest levels
    double halo_s = 0;            ///< ghosts' values, all levels with work for every rank
    double coarse_s = 0;          ///< levels with less: few ranks, many visits, each a latency
    double reductions_s = 0;      ///< dot products
    double replicated_bytes = 0;  ///< the whole mesh, on every rank
    double partition_s = 0;       ///< METIS, on one rank

    double iteration_s() const { return compute_s + halo_s + coarse_s + reductions_s; }
};

/// A model of cost for weak scaling, from one run measured here and a network's two numbers.
/// Counted, not fitted: a W-cycle visits level l 2^l times, each visit 14 products with one
/// exchange with 12 neighbours; an iteration of conjugate gradients reduces three times over log2
/// of the ranks.
struct ScalingModel {
    explicit ScalingModel(const SolveRun& measured);

    double unknowns_a_rank = 1e5;
    double latency_s = 2e-6, bytes_a_second = 1e10;  ///< of a message, on a cluster's network today
    double seconds_an_unknown;                       ///< of an iteration, measured
    double partition_s_an_unknown;                   ///< measured
    double replicated_bytes_an_unknown;              ///< counted
    std::vector<ScalingPoint> points;                ///< 1 to 10^5 ranks
};

void print(const ScalingModel& model);
nlohmann::json json_of(const ScalingModel& model);
#ifdef LIVETET_IMAGES
std::vector<WorkPrecisionLine> lines_of(const ScalingModel& model);
#endif

}  // namespace livetet
