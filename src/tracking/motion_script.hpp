#pragma once

#include <Eigen/Core>

#include <string>
#include <vector>

#include "config/fields.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// Where something is at a moment, from where it stands when the script begins.
struct Keyframe {
    double at_s = 0;
    Eigen::Vector3d by_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn_deg = Eigen::Vector3d::Zero();
};

/// Something that moves: where it stands, and its moves. Between two keyframes way and turn (as a
/// rotation vector, so that it may go round more than once) run smoothly, at rest at both; after
/// the last it stays. Turns are about its own place, along the axes of the frame that it stands in,
/// and come after `turn_deg`.
struct ScriptedBody {
    Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn_deg = Eigen::Vector3d::Zero();
    std::vector<Keyframe> moves;
};

enum class ScriptFrame { organ, tracker };

struct ScriptedTool : ScriptedBody {
    std::string tool = "Sensor";
    ScriptFrame on = ScriptFrame::organ;
    Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();
    std::vector<double> lost_s, jump_s;
    Eigen::Vector3d jump_mm{100, 0, 0};
};

/// A simulated tracker: what moves how, and how well it is seen.
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
            "when it is there; the first keyframe of all is where it stands, at 0 s",
            greater_than<0>());
    v.field("by_mm", k.by_mm, "mm", "how far from where it stood at 0 s");
    v.field("turn_deg", k.turn_deg, "deg",
            "turned since 0 s by: axis times angle, about its own place");
}

template <class Visitor>
void visit_fields(Visitor& v, ScriptedBody& b) {
    v.field("at_mm", b.at_mm, "mm", "where it stands at 0 s");
    v.field("turn_deg", b.turn_deg, "deg", "how it is turned at 0 s: axis times angle");
    v.list("moves", b.moves, "where it is later on; smooth in between");
}

template <class Visitor>
void visit_fields(Visitor& v, ScriptedTool& t) {
    v.field("tool", t.tool, "", "its name: Sensor for SensorToTracker",
            Check<std::string>{"a name", [](const std::string& name) { return !name.empty(); }});
    v.choice("on", t.on, "what it moves with",
             {{ScriptFrame::organ, "organ", "the organ: places and moves are in the organ's frame"},
              {ScriptFrame::tracker, "tracker",
               "nothing: places and moves are in the tracker's frame"}});
    visit_fields(v, static_cast<ScriptedBody&>(t));
    v.field("tip_mm", t.tip_mm, "mm",
            "its tip, from its sensor along its own axes: places are the tip's, turns about it; "
            "the sensor is tracked");
    v.field("lost_s", t.lost_s, "s", "when it is not seen: [from, to, from, to, ...]",
            Check<std::vector<double>>{"pairs of ascending times [from, to, from, to, ...]",
                                       [](const std::vector<double>& times) {
                                           for (std::size_t i = 1; i < times.size(); ++i)
                                               if (!(times[i] > times[i - 1])) return false;
                                           return times.size() % 2 == 0;
                                       }});
    v.field("jump_s", t.jump_s, "s",
            "one sample, the first from each of these times on, is wrong by jump_mm");
    v.field("jump_mm", t.jump_mm, "mm", "how far, in the tracker's frame");
}

template <class Visitor>
void visit_fields(Visitor& v, MotionScript& s) {
    v.field("rate_Hz", s.rate_Hz, "Hz", "samples a second", greater_than<0>());
    v.field("duration_s", s.duration_s, "s", "from the first sample to the last", at_least<0>());
    v.field("position_noise_mm", s.position_noise_mm, "mm", "RMS length of a position's error",
            at_least<0>());
    v.field("rotation_noise_deg", s.rotation_noise_deg, "deg", "RMS angle of a rotation's error",
            at_least<0>());
    v.field("dropout_rate", s.dropout_rate, "", "share of the poses that are missing, at random",
            Check<double>{"from 0 to 1", [](const double& x) { return x >= 0 && x <= 1; }});
    v.field("latency_ms", s.latency_ms, "ms", "how long after its time a sample comes, in the mean",
            at_least<0>());
    v.field("latency_jitter_ms", s.latency_jitter_ms, "ms",
            "RMS deviation from it; none comes before its time", at_least<0>());
    v.field("seed", s.seed, "", "of noise, dropouts and latency: the same seed, the same numbers");
    v.group("organ", s.organ, "the organ in the tracker's frame");
    v.list("tools", s.tools, "what is tracked");
}

/// Reads a script. Throws Error, naming `file` and the key, for what `visit_fields` refuses,
/// keyframes that do not follow each other, a tool named twice, no tools, and more than a million
/// samples.
MotionScript parse_motion_script(const std::string& text, const std::string& file);

/// A recording, and how long after its time each sample comes (none: at its time).
struct DelayedRecording {
    Recording recording;
    std::vector<double> delays_s;
};

/// What the tracker of a script that is as `parse_motion_script` gives it says: a sample every 1 /
/// rate_Hz s from 0 s on.
DelayedRecording simulate(const MotionScript& script);

}  // namespace livetet
