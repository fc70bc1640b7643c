#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/scene/selection_options.hpp"
#include "config/fields.hpp"
#include "tracking/sensor_drive.hpp"

namespace livetet {

/// Parses a time such as "10 ms" or "0.02 s"; result in s. Empty unless it is positive.
std::optional<double> seconds_of(const std::string& text);

enum class Pace { recorded, every_sample };

/// A deformation sensor.
struct SensorOptions {
    std::string tool = "Sensor";
    std::optional<Eigen::Vector3d> place_mm;
    double patch_radius_mm = 15;
    std::optional<double> patch_spread_mm;
    DriveMotion motion = DriveMotion::translation;
    std::optional<double> stiffness_N_per_m;
    int placement = 1;
    bool may_slip = true;

    bool operator==(const SensorOptions&) const = default;
};

/// A tool shown in the image, which may have a blade that cuts.
struct ToolOptions {
    std::string tool = "Stylus";
    std::filesystem::path tip;
    std::optional<std::vector<double>> blade_mm{};

    bool operator==(const ToolOptions&) const = default;
};

/// A target inside the organ, whose error each frame states: a point, points of a file, or a
/// region.
struct TargetOptions : SelectionOptions {
    std::string name;
    std::optional<Eigen::Vector3d> point_mm;
    std::filesystem::path points;

    bool operator==(const TargetOptions&) const = default;
};

/// OpenIGTLink server of the results.
struct PublishOptions {
    std::string address = "127.0.0.1";
    int port = 18945;
    double rate_Hz = 20;
    std::string surface = "Organ";
};

/// How a tracker drives the scene.
struct TrackOptions {
    std::string source;
    std::filesystem::path registration;
    std::string reference_tool = "Reference";
    std::filesystem::path start;
    std::vector<SensorOptions> sensors{SensorOptions{}};
    std::vector<ToolOptions> tools;
    double cut_interval_s = 0.5;
    std::optional<double> cut_by_hand_mm{};
    std::vector<TargetOptions> targets;
    double base_window_s = 1;
    double hold_s = 0.5;
    double release_s = 1;
    double max_displacement_mm = 100;
    double position_noise_mm = 1.4;
    double rotation_noise_deg = 0.5;
    std::optional<double> smoothing_Hz{};    ///< of the one-euro filter; not given: the estimator
    std::optional<NumberOrAuto> ahead_ms{};  ///< not given: 40 with the one-euro filter, else 0
    double display_ms = 0;
    std::optional<int> newton_iterations{};  ///< not given: see newton_iterations_of_frame
    std::string budget{};
    Pace pace = Pace::recorded;
    double speed = 1;
    std::optional<int> request_ms;
    std::optional<PublishOptions> publish;
};

/// Whether the body may be cut while it is tracked: by a tool's blade, or by hand.
inline bool has_blades(const TrackOptions& track) {
    return track.cut_by_hand_mm || std::ranges::any_of(track.tools, [](const ToolOptions& tool) {
               return tool.blade_mm.has_value();
           });
}

template <class Visitor>
void visit_fields(Visitor& v, SensorOptions& o) {
    v.field("tool", o.tool, "", "name of the sensor: Sensor for SensorToTracker");
    v.field("place_mm", o.place_mm, "mm",
            "where on the organ the sensor is to be placed, in the image, RAS: for mesh.grading. A "
            "sensor placed where edges are longer than there is reported");
    v.field("patch_radius_mm", o.patch_radius_mm, "mm",
            "radius about the sensor within which the surface follows it", greater_than<0>());
    v.field("patch_spread_mm", o.patch_spread_mm, "mm",
            "what that radius may be off by, one standard deviation; default: 15 % of it",
            greater_than<0>());
    v.choice(
        "motion", o.motion, "which part of the sensor's motion the patch follows",
        {{DriveMotion::translation, "translation",
          "translation only: for a sensor that rolls on the surface"},
         {DriveMotion::rigid, "rigid", "rotation, too: for a sensor that is fixed to the organ"}});
    v.field("stiffness_N_per_m", o.stiffness_N_per_m, "N/m",
            "the patch follows by springs of this total stiffness, which reduces noise; none: it "
            "follows rigidly",
            greater_than<0>());
    v.field("placement", o.placement, "",
            "increase it during a run after moving the sensor to another place on the organ: it is "
            "placed anew",
            at_least<0, int>());
    v.field("may_slip", o.may_slip, "",
            "whether the sensor lies loose: motion along the surface, where the organ would not go "
            "along, is a slip. Set it to false for a sensor that is sewn or glued on and pulls the "
            "organ sideways");
}

template <class Visitor>
void visit_fields(Visitor& v, ToolOptions& o) {
    v.field("tool", o.tool, "", "name of the tool: Stylus for StylusToTracker");
    v.field("tip", o.tip, "",
            "tip calibration that `livetet calibrate pivot -o FILE` wrote; none: the tool's sensor "
            "is shown");
    v.field("blade_mm", o.blade_mm, "mm",
            "the two ends [x, y, z, x, y, z] of a blade's edge, from the tip or, without one, from "
            "the tool's sensor: what the edge sweeps in the organ is cut. 1 to 1000 mm long. Not "
            "with elements: P2 in the mixed form; a run that is to cut has a blade from its start");
}

template <class Visitor>
void visit_fields(Visitor& v, TargetOptions& o) {
    v.field("name", o.name, "", "name of the target; points of a file have their own");
    v.field("point_mm", o.point_mm, "mm", "a point of the image, RAS, inside the organ");
    v.field("points", o.points, "", "points of the image: a CSV of name,x_mm,y_mm,z_mm");
    visit_selection(v, o);
}

template <class Visitor>
void visit_fields(Visitor& v, PublishOptions& o) {
    v.field("address", o.address, "",
            "address to listen on: 127.0.0.1 for this machine only, 0.0.0.0 for all its networks");
    v.field("port", o.port, "",
            "TCP port; a tracker's own server usually has 18944; 0: any free port",
            within<int>({0, 65535}));
    v.field("rate_Hz", o.rate_Hz, "Hz", "maximum frame rate; 0: every frame", at_least<0>());
    v.field("surface", o.surface, "", "name of the organ's surface");
}

/// What is shown, and what cuts.
template <class Visitor>
void visit_blades(Visitor& v, TrackOptions& t) {
    v.list("tools", t.tools, "tools shown in the image. May be changed in the file during a run");
    v.field(
        "cut_interval_s", t.cut_interval_s, "s",
        "a cut opens within this time after the blade, by the samples' clock: what is cut in its "
        "first half opens together at its end, and is prepared in its second half, between "
        "frames; 0: in the frame of the blade",
        within({0, 60}));
    v.field(
        "cut_by_hand_mm", t.cut_by_hand_mm, "mm",
        "lines that are drawn in `livetet view SCENE` cut so deep: over the organ from its surface "
        "on, away from the viewer; over a slice half of it to each side; none: they do not",
        within({0.1, 1000}));
}

template <class Visitor>
void visit_fields(Visitor& v, TrackOptions& t) {
    v.field("source", t.source, "",
            "openigtlink://host:port of a tracker server such as PLUS, a recording (PLUS sequence: "
            ".igs.mha, .seq.mha, .nrrd), or the script of a simulated tracker (.yaml)");
    v.field("registration", t.registration, "",
            "registration that `livetet register --reference TOOL -o FILE` wrote");
    v.field("reference_tool", t.reference_tool, "",
            "the reference sensor, fixed to the patient (Reference for ReferenceToTracker)");
    v.field(
        "start", t.start, "",
        "result of `livetet register --deform` or `solve` on this mesh: the organ is held as its "
        "last frame has it, and sensors move it from there; none: it begins at rest");
    v.list("sensors", t.sensors,
           "the sensors that move the surface; where patches overlap, the mean is used. May be "
           "changed in the file during a run");
    visit_blades(v, t);
    v.list("targets", t.targets,
           "what each frame states the error of: each by point_mm, points, or a selection of nodes "
           "(of a region, the worst place counts); none: no error statement");
    v.field("base_window_s", t.base_window_s, "s",
            "time over which a sensor's position at rest is averaged", at_least<0>());
    v.field("hold_s", t.hold_s, "s", "time for which a lost sensor holds its patch", at_least<0>());
    v.field("release_s", t.release_s, "s",
            "time in which the patch is then released or, if the sensor is back, taken up again",
            at_least<0>());
    v.field("max_displacement_mm", t.max_displacement_mm, "mm",
            "a sensor farther than this from where it was placed counts as lost",
            greater_than<0>());
    v.field("position_noise_mm", t.position_noise_mm, "mm",
            "the tracker's position error, RMS length, as its maker states it: what the pose "
            "estimator begins with; it learns if the noise is greater",
            within({0.01, 100}));
    v.field("rotation_noise_deg", t.rotation_noise_deg, "degrees",
            "the tracker's rotation error, RMS angle", within({0.001, 45}));
    v.field("smoothing_Hz", t.smoothing_Hz, "Hz",
            "smooths poses by the one-euro filter with this cut-off frequency at rest, in place of "
            "the pose estimator; 0: no smoothing",
            at_least<0>());
    v.field("ahead_ms", t.ahead_ms, "ms",
            "time by which poses are extrapolated, to make up for the time until the frame is "
            "shown; auto: the measured time from a sample's arrival to its published frame, and "
            "display_ms, at most 100 together; default: 0, or 40 with a one-euro filter, for its "
            "lag",
            within<NumberOrAuto>({0, 500}, ", or auto"));
    v.field("display_ms", t.display_ms, "ms",
            "with ahead_ms: auto, the part of the latency that cannot be measured here: from the "
            "tracker's measurement to its arrival, and from the published frame to the screen",
            within({0, 100}));
    v.field(
        "linearisations", t.newton_iterations, "",
        "Newton iterations of a frame; default: 1, but 2 with time.scheme: newmark in the mixed "
        "form with a poisson of 0.499 or above, where bodies keep swinging with 1",
        within<int>({1, 4}));
    v.field("budget", t.budget, "",
            "time budget of a frame, such as 10 ms: as many solver iterations as fit, at least "
            "one; none: to the solver's relative_tolerance, however long it takes",
            Check<std::string>{"a positive time with its unit, ms or s: 10 ms",
                               [](const std::string& text) {
                                   return text.empty() || seconds_of(text).has_value();
                               }});
    v.choice("pace", t.pace, "which samples of a recording become frames",
             {{Pace::recorded, "recorded",
               "at its own pace: each frame takes the newest sample, others are missed"},
              {Pace::every_sample, "every-sample", "every sample in turn, however long it takes"}});
    v.field("speed", t.speed, "", "speed of a recording relative to its own pace",
            greater_than<0>());
    v.field("request_ms", t.request_ms, "ms",
            "interval at which TDATA is requested of the server (STT_TDATA); 0: as often as it "
            "can; for a server that sends none unasked",
            at_least<0, int>());
    v.group("publish", t.publish,
            "OpenIGTLink server, to which 3D Slicer can connect to show the deforming organ");
}

/// Checks a list of targets: each by one of point, points and a selection, and with a name unless
/// the points have. `list`: its key. Throws Error with the place of a key.
void check_targets(std::span<const TargetOptions> targets, std::string_view list,
                   const KeyPlaces& places);

/// Checks keys of a track section against each other. Throws Error with the place of a key.
void check_track(const TrackOptions& track, const KeyPlaces& places);

}  // namespace livetet
