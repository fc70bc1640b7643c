#include <fmt/format.h>

#include "apps/commands.hpp"
#include "base/error.hpp"
#include "io/sequence_file.hpp"
#include "io/tip_file.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

struct PivotArguments {
    std::filesystem::path recording, output;
    std::string tool = "Stylus";
};

void calibrate(const PivotArguments& arguments) {
    const Recording recording = read_sequence(arguments.recording);
    const PivotCalibration c = naming(arguments.recording.string(), [&] {
        const auto poses = usable_poses(recording, arguments.tool);
        return naming(arguments.tool, [&] { return calibrate_pivot(poses); });
    });
    const Eigen::Vector3d tip = 1e3 * c.tool_from_tip.translation, pivot = 1e3 * c.pivot_in_tracker;
    fmt::print("tip of {:<12} ({:.3f}, {:.3f}, {:.3f}) mm from its sensor\n", arguments.tool, tip.x(), tip.y(),
               tip.z());
    fmt::print("pivot              ({:.3f}, {:.3f}, {:.3f}) mm in the tracker's frame\n", pivot.x(), pivot.y(),
               pivot.z());
    fmt::print("residual           {:.3f} mm RMS\n", 1e3 * c.rms);
    fmt::print("poses              {} used, {} rejected as outliers\n", c.used, c.rejected);
    fmt::print("spread             {:.1f} degrees between the farthest poses, rank {} of 6\n", c.spread_deg, c.rank);
    if (!arguments.output.empty()) {
        write_tip(arguments.output, arguments.tool, c);
        fmt::print("written            {}\n", arguments.output.string());
    }
}

}  // namespace

void add_calibrate_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("calibrate", "Calibrations of tracked tools");
    command->require_subcommand(1);
    CLI::App* pivot = command->add_subcommand(
        "pivot", "The offset of a tool's tip, from a recording of the tool turning about its resting tip");
    auto arguments = std::make_shared<PivotArguments>();
    pivot->add_option("recording", arguments->recording, "tracker recording (PLUS sequence)")->required();
    pivot->add_option("--tool", arguments->tool, "the tool: Stylus for StylusToTracker")->capture_default_str();
    pivot->add_option("-o,--output", arguments->output, "write the offset to this file (.json) for `livetet register`");
    pivot->callback([arguments] { calibrate(*arguments); });
}

}  // namespace livetet
