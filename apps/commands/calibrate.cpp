#include <fmt/format.h>

#include "apps/commands/commands.hpp"
#include "apps/commands/read_until_signal.hpp"
#include "apps/scene/outputs.hpp"
#include "base/error.hpp"
#include "geometry/error_ellipsoid.hpp"
#include "io/tip_file.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

struct CalibrateArguments {
    std::string source, tool = "Stylus";
    std::filesystem::path tip, output;
    std::optional<double> length_s{};
};

/// Result of `calibrate` for the tool's poses. Its errors name the source and the tool.
template <class Calibrate>
auto calibrated(const CalibrateArguments& a, const Calibrate& calibrate) {
    expect_ending("--output", a.output, ".json");
    refuse_to_overwrite("--output", a.output, {a.source});
    RecordingOptions options;
    options.tools = {a.tool};
    options.length_s = a.length_s;
    options.title = "calibrate";
    const Recording recording = read_until_signal(a.source, options);
    return with_context(a.source, [&] {
        const auto poses = usable_poses(recording, a.tool);
        return with_context(a.tool, [&] { return calibrate(poses); });
    });
}

void write(const CalibrateArguments& a, const ToolTip& tip) {
    if (a.output.empty()) return;
    write_tip(a.output, tip);
    fmt::print("written            {}\n", a.output.string());
}

void pivot(const CalibrateArguments& a) {
    const PivotCalibration c =
        calibrated(a, [](const auto& poses) { return calibrate_pivot(poses); });
    constexpr double worst_rms_m = 0.005;
    if (c.rms > worst_rms_m)
        fail(
            "{}: {}: pivot calibration: the tip wanders by {:.1f} mm RMS, expected at most {:g}: "
            "rest it, and turn the tool about it",
            a.source, a.tool, 1e3 * c.rms, 1e3 * worst_rms_m);
    const Eigen::Vector3d tip = 1e3 * c.tool_from_tip.translation, pivot = 1e3 * c.pivot_in_tracker;
    fmt::print("tip of {:<12} ({:.3f}, {:.3f}, {:.3f}) mm from its sensor\n", a.tool, tip.x(),
               tip.y(), tip.z());
    fmt::print("pivot              ({:.3f}, {:.3f}, {:.3f}) mm in the tracker's frame\n", pivot.x(),
               pivot.y(), pivot.z());
    fmt::print("residual           {:.3f} mm RMS\n", 1e3 * c.rms);
    std::optional<Eigen::Matrix3d> covariance;
    if (c.covariance) {
        covariance = c.covariance->topLeftCorner<3, 3>();
        fmt::print("error of the tip   {:.2f} mm with 95 %, by what the residuals tell\n",
                   1e3 * error_ellipsoid(*covariance).radius_95);
    }
    fmt::print("poses              {} used, {} rejected as outliers\n", c.used, c.rejected);
    fmt::print("spread             {:.1f} degrees between the farthest poses, rank {} of 6\n",
               c.spread_deg, c.rank);
    write(a, {a.tool, c, {}, covariance});
}

void spin(const CalibrateArguments& a) {
    std::optional<ToolTip> tip;
    if (!a.tip.empty()) tip = read_tip(a.tip, a.tool);
    if (!tip && !a.output.empty())
        fail(
            "--output {}: a shaft is kept with its tip, expected --tip FILE (of `livetet calibrate "
            "pivot`)",
            a.output.string());
    std::optional<Eigen::Vector3d> place;
    if (tip) place = tip->pivot.tool_from_tip.translation;
    const SpinCalibration c =
        calibrated(a, [&](const auto& poses) { return calibrate_spin(poses, place); });
    fmt::print("shaft of {:<10} ({:.5f}, {:.5f}, {:.5f}) in its sensor's frame, {}\n", a.tool,
               c.shaft_in_tool.x(), c.shaft_in_tool.y(), c.shaft_in_tool.z(),
               tip ? "towards the tip" : "or the opposite direction (--tip decides)");
    fmt::print("tilt               {:.2f} degrees RMS\n", c.tilt_deg);
    fmt::print("turn               {:.0f} degrees round the shaft, {} poses\n", c.turn_deg, c.used);
    if (!tip) return;
    tip->spin = c;
    write(a, *tip);
}

CLI::App* add(CLI::App* command, const std::shared_ptr<CalibrateArguments>& a, const char* name,
              const char* text) {
    CLI::App* added = command->add_subcommand(name, text);
    added
        ->add_option("source", a->source,
                     "tracker recording (PLUS sequence), or openigtlink://host:port of a tracker "
                     "server: the tool is "
                     "then followed until Ctrl-C or --for")
        ->required();
    added->add_option("--for", a->length_s, "recording time in seconds, from the first pose")
        ->check(CLI::PositiveNumber);
    added->add_option("--tool", a->tool, "name of the tool: Stylus for StylusToTracker")
        ->capture_default_str();
    added->add_option("-o,--output", a->output,
                      "write the tip to this file (.json) for `livetet register`");
    return added;
}

}  // namespace

void add_calibrate_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("calibrate", "Calibrations of tracked tools");
    command->require_subcommand(1);
    auto a = std::make_shared<CalibrateArguments>();
    add(command, a, "pivot",
        "The offset of a tool's tip, from the tool turning about its resting tip, recorded or as "
        "it is tracked")
        ->callback([a] { pivot(*a); });
    CLI::App* turned = add(command, a, "spin",
                           "The direction of a tool's shaft, from the tool turning about its own "
                           "shaft, recorded or as it is tracked; "
                           "the tip's Z axis will point along it, away from the sensor");
    turned->add_option("--tip", a->tip,
                       "the tool's tip, from `livetet calibrate pivot -o`: decides which end of "
                       "the shaft is which");
    turned->callback([a] { spin(*a); });
}

}  // namespace livetet
