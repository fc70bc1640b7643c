#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/report/report_parts.hpp"
#include "io/result_file.hpp"

namespace livetet {

/// One step of a solve, as its result keeps it. Static: `time_s` is the share of the load, `step_s`
/// the step's part of it.
struct SolvedStep {
    double time_s = 0, step_s = 0, seconds = 0, imbalance = 0, time_error_mm = 0;
    std::size_t linearisations = 0, iterations = 0;
    bool converged = false;
    bool kept = true;  ///< else it was done again in other lengths
};

/// What a solve says about itself.
struct SolvedRun {
    std::string solver, version, failure;
    std::size_t levels = 0, ranks = 1;
    std::size_t inverted_tets = 0;  ///< in the end
    bool converged = false, is_static = false;
    double restarted_at_s = 0;  ///< 0: it was not; steps and seconds are those from there on
    double mesh_s = 0, setup_s = 0, solve_s = 0, peak_bytes = 0;
    std::vector<std::pair<std::string, Eigen::Vector3d>>
        forces_N;  ///< on the body, by the scene's key
    std::vector<SolvedStep> steps;

    std::vector<const SolvedStep*> kept_steps() const;
};

/// What `livetet solve` came to: read off its result.
struct SolveReport {
    std::string source, scene_text;
    std::size_t tets = 0, nodes = 0, frames = 0;
    double first_s = 0, last_s = 0;
    std::size_t largest_frame = 0;  ///< of the kept frames, the one of the largest displacement
    double largest_mm = 0,
           last_mm = 0;               ///< the largest displacement of all frames, and of the last
    std::optional<SolvedRun> run;     ///< not in files of earlier versions
    std::vector<std::int32_t> fixed;  ///< nodes, where the scene and its masks are known
    std::vector<ExplainedPart>
        parts;  ///< what was built and left out; empty where that is not known

    bool is_static() const { return run && run->is_static; }
};

/// Throws Error for a result without frames, or with a text about its run that does not hold
/// together.
SolveReport make_solve_report(const ResultReader& result, const std::filesystem::path& source);

/// Whether it converged, and how far the body moved.
std::vector<std::string> verdicts(const SolveReport& report);
std::string report_text(const SolveReport& report);
std::string report_json(const SolveReport& report);
std::string report_page(const SolveReport& report, std::span<const PagePicture> pictures,
                        const std::string& no_pictures = "");

}  // namespace livetet
