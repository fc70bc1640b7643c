#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/live/run_result.hpp"
#include "apps/phantom/truth_file.hpp"
#include "apps/report/report_parts.hpp"
#include "apps/report/target_error.hpp"
#include "apps/scene/explanation.hpp"
#include "base/distribution.hpp"

namespace livetet {

/// How long the kept frames took and how they ended. Times in ms. `over_budget` counts those that
/// took longer than the run's budget, `cut_short` those whose solve it ended. What the run did not
/// record is a distribution of nothing.
struct FrameStatistics {
    std::size_t kept = 0, over_budget = 0, cut_short = 0, not_converged = 0, registration_held = 0,
                registration_lost = 0;
    Distribution frame_ms, sensor_ms, forces_ms, operator_ms, solve_ms, finish_ms, output_ms,
        iterations;
    Distribution error_estimate_mm;  ///< of each frame's estimate of its own remaining error, RMS
                                     ///< over the nodes
};

/// A deformation sensor as the scene has it.
struct ReportSensor {
    std::string tool;
    double patch_radius_mm = 0;
    bool turns = false;                         ///< the patch follows its turn, too
    std::optional<double> stiffness_N_per_m{};  ///< none: a hard patch
};

/// What sensors do, in the order of DriveStatus.
inline constexpr const char* sensor_states[] = {"placing", "following", "returning",
                                                "holding", "releasing", "released"};

/// What one tracked run was worth.
struct Report {
    std::string source, scene_text;
    std::vector<ReportSensor> sensors;
    std::optional<std::array<double, 6>>
        sensor_frames;  ///< frames that sensors spent in each of `sensor_states`, of all sensors
    std::vector<ExplainedPart>
        parts;  ///< what the run built and left out; empty where its scene is not known
    RunInfo run;
    FrameStatistics frames;
    double first_s = 0, last_s = 0;
    double largest_press_mm = 0;        ///< as the deformation sensor saw it
    std::size_t deepest_frame = 0;      ///< of the kept frames, the one with the largest press
    std::optional<TargetErrors> truth;  ///< only where the truth is known
};

/// Throws Error for a result without frames, and where `compare_with_truth` does.
Report make_report(const RunResult& result, const Truth* truth = nullptr);

/// How many times smaller the error at the targets should be with deformation than without.
inline constexpr double wanted_gain = 3;

/// The sentences that say whether the run was good: frame times; where it had a budget, how it was
/// kept; with a truth, how much the deformation gained at the deepest press, and whether moving the
/// whole organ moved targets.
std::vector<std::string> verdicts(const Report& report);

/// What a sensor moves, and how.
std::string sensor_text(const ReportSensor& sensor);

/// A page of tables to read, lines of at most 100 characters.
std::string report_text(const Report& report);

/// The same figures as JSON text, with units in the keys' names.
std::string report_json(const Report& report);

/// The same figures as one HTML page that needs no other file. `no_pictures`: why there are none,
/// where there are none.
std::string report_page(const Report& report, std::span<const PagePicture> pictures,
                        const std::string& no_pictures = "");

/// Reads what `livetet track` wrote, writes report.txt, report.json and the pictures into the
/// folder "report" beside it, the JSON to `json` as well unless that is empty, and prints the text.
/// Throws Error where it cannot.
void report_result(const std::filesystem::path& result, const std::filesystem::path& json);

}  // namespace livetet
