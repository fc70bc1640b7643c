#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/run_result.hpp"
#include "apps/target_error.hpp"
#include "apps/truth_file.hpp"
#include "base/distribution.hpp"

namespace livetet {

/// How long the kept frames took and how they ended. Times in ms. `over_budget` counts those that took longer than the
/// run's budget, `cut_short` those whose solve it ended. What the run did not record is a distribution of nothing.
struct FrameStatistics {
    std::size_t kept = 0, over_budget = 0, cut_short = 0, not_converged = 0, registration_held = 0, registration_lost = 0;
    Distribution frame_ms, sensor_ms, forces_ms, operator_ms, solve_ms, finish_ms, output_ms, iterations;
    Distribution error_estimate_mm;  ///< of each frame's estimate of its own remaining error, RMS over the nodes
};

/// What one tracked run was worth.
struct Report {
    std::string source;
    RunInfo run;
    FrameStatistics frames;
    double first_s = 0, last_s = 0;
    double largest_press_mm = 0;        ///< as the deformation sensor saw it
    std::size_t deepest_frame = 0;      ///< of the kept frames, the one with the largest press
    std::optional<TargetErrors> truth;  ///< only where the truth is known
};

/// Throws Error for a result without frames, and where `compare_with_truth` does.
Report make_report(const RunResult& result, const Truth* truth = nullptr);

/// The sentences that say whether the run was good: frame times; where it had a budget, how it was kept; with a truth,
/// how much the deformation gained at the deepest press, and whether moving the whole organ moved targets.
std::vector<std::string> verdicts(const Report& report);

/// A page of tables to read, lines of at most 100 characters.
std::string report_text(const Report& report);

/// The same figures as JSON text, with units in the keys' names.
std::string report_json(const Report& report);

/// Reads what `livetet track` wrote, writes report.txt, report.json and the pictures into the folder "report" beside
/// it, the JSON to `json` as well unless that is empty, and prints the text. Throws Error where it cannot.
void report_result(const std::filesystem::path& result, const std::filesystem::path& json);

}  // namespace livetet
