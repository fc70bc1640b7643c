#pragma once

#include <Eigen/Core>

#include <string>
#include <vector>

#include "config/fields.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// Pose of a scripted body at a time, relative to its pose at the start of the script.
struct Keyframe {
    double at_s = 0;
    Eigen::Vector3d by_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn_deg = Eigen::Vector3d::Zero();
};

/// A moving body: its initial pose and its keyframes. Between two keyframes translation and
/// rotation vector are interpolated smoothly, with zero velocity at both; the rotation vector
/// allows more than one turn. After the last keyframe the body rests. Rotations are about the
/// body's own origin, along the axes of its parent frame, and are applied after `turn_deg`.
struct ScriptedBody {
    Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn_deg = Eigen::Vector3d::Zero();
    std::vector<Keyframe> moves;
};

enum class ScriptFrame { organ, tracker };

/// A scripted tool, with the intervals in which it is lost and the times at which a sample jumps.
struct ScriptedTool : ScriptedBody {
    std::string tool = "Sensor";
    ScriptFrame on = ScriptFrame::organ;
    Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();
    std::vector<double> lost_s, jump_s;
    Eigen::Vector3d jump_mm{100, 0, 0};
};

/// A simulated tracker: the motion of the organ and the tools, and the quality of the tracking.
struct MotionScript {
    double rate_Hz = 20;
    double duration_s = 30;
    double position_noise_mm = 0;
    double rotation_noise_deg = 0;
    double dropout_rate = 0;
    double latency_ms = 0;
    double latency_jitter_ms = 0;
    int seed = 1;
    ScriptedBody organ;
    std::vector<ScriptedTool> tools;
};

template <class Visitor>
void visit_fields(Visitor& v, Keyframe& k) {
    v.field("at_s", k.at_s, "s",
            "time of the keyframe; the first keyframe, at 0 s, is the initial pose",
            greater_than<0>());
    v.field("by_mm", k.by_mm, "mm", "displacement from the initial position");
    v.field("turn_deg", k.turn_deg, "deg",
            "rotation from the initial orientation about its own origin: axis times angle");
}

template <class Visitor>
void visit_fields(Visitor& v, ScriptedBody& b) {
    v.field("at_mm", b.at_mm, "mm", "initial position");
    v.field("turn_deg", b.turn_deg, "deg", "initial orientation: axis times angle");
    v.list("moves", b.moves, "keyframes; smooth motion in between");
}

template <class Visitor>
void visit_fields(Visitor& v, ScriptedTool& t) {
    v.field("tool", t.tool, "", "name of the tool: Sensor for SensorToTracker",
            Check<std::string>{"a name", [](const std::string& name) { return !name.empty(); }});
    v.choice(
        "on", t.on, "parent frame",
        {{ScriptFrame::organ, "organ", "moves with the organ; poses are in the organ's frame"},
         {ScriptFrame::tracker, "tracker", "fixed in space; poses are in the tracker's frame"}});
    visit_fields(v, static_cast<ScriptedBody&>(t));
    v.field(
        "tip_mm", t.tip_mm, "mm",
        "offset of the tip from the sensor, along the sensor's axes: positions are the tip's and "
        "rotations are about it; the sensor is tracked");
    v.field("lost_s", t.lost_s, "s",
            "intervals in which the tool is not seen: [from, to, from, to, ...]",
            Check<std::vector<double>>{"pairs of ascending times [from, to, from, to, ...]",
                                       [](const std::vector<double>& times) {
                                           for (std::size_t i = 1; i < times.size(); ++i)
                                               if (!(times[i] > times[i - 1])) return false;
                                           return times.size() % 2 == 0;
                                       }});
    v.field("jump_s", t.jump_s, "s", "at each of these times one sample is displaced by jump_mm");
    v.field("jump_mm", t.jump_mm, "mm", "displacement of those samples, in the tracker's frame");
}

template <class Visitor>
void visit_fields(Visitor& v, MotionScript& s) {
    v.field("rate_Hz", s.rate_Hz, "Hz", "samples per second", greater_than<0>());
    v.field("duration_s", s.duration_s, "s", "time from the first sample to the last",
            at_least<0>());
    v.field("position_noise_mm", s.position_noise_mm, "mm", "RMS length of a position's error",
            at_least<0>());
    v.field("rotation_noise_deg", s.rotation_noise_deg, "deg", "RMS angle of a rotation's error",
            at_least<0>());
    v.field("dropout_rate", s.dropout_rate, "", "fraction of the poses that are missing at random",
            within({0, 1}));
    v.field("latency_ms", s.latency_ms, "ms", "mean delay of a sample", at_least<0>());
    v.field("latency_jitter_ms", s.latency_jitter_ms, "ms",
            "RMS deviation of the delay; no sample arrives early", at_least<0>());
    v.field("seed", s.seed, "", "random seed of noise, dropouts and latency");
    v.group("organ", s.organ, "the organ in the tracker's frame");
    v.list("tools", s.tools, "the tracked tools");
}

/// Reads a script. Throws Error, naming `file` and the key, for values that `visit_fields` rejects,
/// keyframes that are not in ascending order, a tool named twice, no tools, and more than a million
/// samples.
MotionScript parse_motion_script(const std::string& text, const std::string& file);

/// A recording and the delay of each sample, seconds. No delays: each sample arrives at its time
/// stamp.
struct DelayedRecording {
    Recording recording;
    std::vector<double> delays_s;
};

/// Simulates the tracker of a script from `parse_motion_script`: one sample every 1 / rate_Hz s,
/// starting at 0 s.
DelayedRecording simulate(const MotionScript& script);

}  // namespace livetet
