#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/phantom/truth_file.hpp"
#include "apps/report/report_parts.hpp"
#include "io/result_file.hpp"

namespace livetet {

/// A step of a solve, from its result. Static: `time_s` is the share of the load, `step_s` its
/// increment.
struct SolvedStep {
    double time_s = 0, step_s = 0, seconds = 0, imbalance = 0, time_error_mm = 0;
    std::size_t newton_iterations = 0, iterations = 0;
    bool converged = false;
    bool kept = true;  ///< false: rejected and repeated with another length
};

/// Description of a solve in its result.
struct SolvedRun {
    std::string solver, version, failure;
    std::size_t levels = 0, ranks = 1;
    std::size_t inverted_tets = 0;  ///< at the end
    bool converged = false, is_static = false;
    double restarted_at_s = 0;  ///< 0: no restart; steps and seconds count from there
    double mesh_s = 0, setup_s = 0, solve_s = 0, peak_bytes = 0;
    std::vector<std::pair<std::string, Eigen::Vector3d>>
        forces_N;  ///< on the body, by key of the scene
    std::vector<SolvedStep> steps;

    std::vector<const SolvedStep*> kept_steps() const;
};

/// The last frame against the truth of a phantom at its deepest press, mm.
struct SolvedTargets {
    double depth_mm = 0;
    std::size_t targets = 0, moving = 0;  ///< in all; those that move by more than 3 mm
    double rms_mm = 0, worst_mm = 0;      ///< at those that move
    double rigid_rms_mm = 0;              ///< the same without deformation
};

/// Report of a result of `livetet solve`.
struct SolveReport {
    std::string source, scene_text;
    std::size_t tets = 0, nodes = 0, frames = 0;
    std::string elements;  ///< "60000 tets", "5000 hexahedra"
    std::string cuts;      ///< of the scene (cuts_text); empty: none, or the scene is unknown
    double first_s = 0, last_s = 0;
    std::size_t largest_frame = 0;  ///< kept frame with the largest displacement
    double largest_mm = 0,
           last_mm = 0;               ///< largest displacement of all frames, and of the last
    std::optional<SolvedRun> run;     ///< missing in files of earlier versions
    std::vector<std::int32_t> fixed;  ///< fixed nodes, if the scene and its masks are known
    std::vector<std::string>
        beyond_model{};                ///< of the largest frame: what cannot be meant; locking
    std::vector<ExplainedPart> parts;  ///< parts built and left out; empty if unknown
    std::optional<SolvedTargets> truth{};
    bool is_sweep = false;  ///< frames are fits of a sweep (register --live), at times in s

    /// Times are shares of the load, not s.
    bool has_load_shares() const { return run && run->is_static && !is_sweep; }
};

/// Makes a report; `truth`: of the phantom, or null. Throws Error if the result has no frames, or
/// an inconsistent description, and if no target of the truth moves.
SolveReport make_solve_report(const ResultReader& result, const std::filesystem::path& source,
                              const Truth* truth = nullptr);

/// Sentences on convergence and on the motion of the body.
std::vector<std::string> verdicts(const SolveReport& report);
std::string report_text(const SolveReport& report);
std::string report_json(const SolveReport& report);
std::string report_page(const SolveReport& report, std::span<const PagePicture> pictures,
                        const std::string& no_pictures = "");

}  // namespace livetet
