#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/live/run_result.hpp"
#include "apps/phantom/truth_file.hpp"
#include "apps/report/report_parts.hpp"
#include "apps/report/stated_error.hpp"
#include "apps/report/target_error.hpp"
#include "apps/scene/explanation.hpp"
#include "base/distribution.hpp"

namespace livetet {

/// Times of the kept frames, ms, and how they ended. `over_budget`: frames slower than the run's
/// budget; `cut_short`: frames whose solve it stopped; `turned_over`: frames with elements that
/// were turned over; `ahead_ms`: by how much poses were
/// extrapolated, of the frames with any. Values that were not recorded have an empty distribution.
struct FrameStatistics {
    std::size_t kept = 0, over_budget = 0, cut_short = 0, not_converged = 0, turned_over = 0,
                registration_held = 0, registration_lost = 0;
    Distribution frame_ms, sensor_ms, forces_ms, operator_ms, solve_ms, finish_ms, output_ms,
        statement_ms, ahead_ms, iterations;
    Distribution error_estimate_mm;  ///< of each frame's estimate of its own remaining error, RMS
                                     ///< over the nodes
};

/// A deformation sensor of the scene.
struct ReportSensor {
    std::string tool;
    double patch_radius_mm = 0;
    bool turns = false;                         ///< the patch follows its rotation, too
    std::optional<double> stiffness_N_per_m{};  ///< none: a rigid patch
};

/// Names of DriveStatus, in its order.
inline constexpr const char* sensor_states[] = {"placing", "following", "returning",
                                                "holding", "releasing", "released"};

/// Report of a tracked run.
struct Report {
    std::string source, scene_text;
    std::vector<ReportSensor> sensors;
    std::optional<std::array<double, 6>>
        sensor_frames;                 ///< frames in each of `sensor_states`, summed over sensors
    std::vector<std::string> notes;    ///< what the frame of the deepest press cannot mean; locking
    std::size_t unplaced = 0;          ///< sensors that were still being placed at the end
    std::size_t slips = 0;             ///< how often a sensor slipped, of all sensors
    bool prepares_cuts = true;         ///< between frames: not with pace: every-sample
    std::vector<ExplainedPart> parts;  ///< parts built and left out; empty if the scene is unknown
    RunInfo run;
    std::string elements;  ///< see elements_text
    FrameStatistics frames;
    double first_s = 0, last_s = 0;
    double largest_press_mm = 0;         ///< as measured by the deformation sensor
    std::size_t deepest_frame = 0;       ///< kept frame with the largest press
    std::optional<TargetErrors> truth;   ///< if the truth is known
    std::optional<StatedErrors> stated;  ///< if the run has targets
};

/// Makes a report. Throws Error if the result has no frames, and where `compare_with_truth` does.
Report make_report(const RunResult& result, const Truth* truth = nullptr);

/// Required ratio of the errors at the targets without and with deformation.
inline constexpr double wanted_gain = 3;

/// Sentences on the quality of the run: frame times; how a budget was kept; with a truth, how much
/// the deformation gained at the deepest press, and whether moving the whole organ moved targets.
std::vector<std::string> verdicts(const Report& report);

/// Describes what a sensor moves, and how.
std::string sensor_text(const ReportSensor& sensor);

/// The report as text, with lines of at most 100 characters.
std::string report_text(const Report& report);

/// The report as JSON, with units in its keys.
std::string report_json(const Report& report);

/// The report as a self-contained HTML page. `no_pictures`: why there are none.
std::string report_page(const Report& report, std::span<const PagePicture> pictures,
                        const std::string& no_pictures = "");

}  // namespace livetet
