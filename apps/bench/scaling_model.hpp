#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "apps/bench/solve_run.hpp"
#ifdef LIVETET_IMAGES
#include "apps/plots/pictures.hpp"
#endif

namespace livetet {

/// Predicted cost of an iteration, and of its set-up, on a number of ranks with `unknowns_a_rank`
/// each.
struct ScalingPoint {
    double ranks = 1, levels = 1;
    double compute_s = 0;     ///< of an iteration on the finest levels
    double halo_s = 0;        ///< exchange of ghost values on all levels with work for every rank
    double coarse_s = 0;      ///< coarse levels: few ranks, many visits, each with a latency
    double reductions_s = 0;  ///< dot products
    double messages = 0, message_bytes = 0;  ///< of an iteration, sent by a rank
    double partition_s = 0;                  ///< METIS, on one rank; 0: PTScotch, on all

    double iteration_s() const { return compute_s + halo_s + coarse_s + reductions_s; }
};

/// Cost model for weak scaling, from two measured runs and two numbers of a network. A W-cycle
/// visits level l 2^l times; each visit has 14 products, each with an exchange with 12 neighbours;
/// an iteration of conjugate gradients has three reductions over log2 of the ranks. Numbers and
/// bytes of messages are then scaled to those that were counted on several ranks.
struct ScalingModel {
    /// `timed`: gives the seconds of an iteration and of METIS; `counted`: on the most ranks, its
    /// messages. `refine`: refinements of the file's mesh, which ranks make from their own parts.
    ScalingModel(const SolveRun& timed, const SolveRun& counted, int refine);

    double unknowns_a_rank = 1e5;
    double latency_s = 2e-6, bytes_a_second = 1e10;  ///< of a message on a present cluster network
    double seconds_an_unknown;                       ///< of an iteration, measured
    double partition_s_an_unknown;                   ///< measured
    double file_share;                               ///< unknowns of the file's mesh, of all
    int counted_ranks;
    double messages_factor = 1, bytes_factor = 1;  ///< counted over what the model has
    std::vector<ScalingPoint> points;              ///< 1 to 10^5 ranks
};

void print(const ScalingModel& model);
nlohmann::json json_of(const ScalingModel& model);
#ifdef LIVETET_IMAGES
std::vector<WorkPrecisionLine> lines_of(const ScalingModel& model);
#endif

}  // namespace livetet
