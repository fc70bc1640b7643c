#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace livetet {

/// Figures of a run of `livetet solve` (--json), all ranks together; `peak_bytes_most` is of the
/// largest rank.
struct SolveRun {
    std::string name, solver;
    int ranks = 1;
    bool converged = false;
    double unknowns = 0;
    double mesh_s = 0, partition_s = 0, setup_s = 0, forces_s = 0, assembly_s = 0,
           preconditioner_s = 0, linear_s = 0, output_s = 0;
    int steps = 0, newton_iterations = 0, iterations = 0;
    double largest_mm = 0;
    double peak_bytes = 0, peak_bytes_most = 0, messages = 0, message_bytes = 0, reductions = 0;

    /// Time from a mesh in memory to equilibrium, s.
    double solution_s() const {
        return partition_s + setup_s + forces_s + assembly_s + preconditioner_s + linear_s;
    }
    double bytes_an_unknown() const { return peak_bytes / unknowns; }
    double iterations_a_solve() const {
        return newton_iterations > 0 ? static_cast<double>(iterations) / newton_iterations : 0;
    }
};

/// Runs the program on this number of ranks, or without a launcher if that is empty; its output
/// goes to a log beside the scene. Throws Error with its last message if it fails, but not if it
/// does not converge, and if it takes longer than `time_limit_s`.
SolveRun run_solve(const std::string& name, const std::string& launcher, int ranks,
                   const std::filesystem::path& scene, std::optional<double> time_limit_s = {});

nlohmann::json json_of(const SolveRun& run);

}  // namespace livetet
