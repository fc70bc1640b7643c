#include "tracking/motion_script.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "config/yaml.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"
#include "tracking/smooth_step.hpp"

namespace livetet {

namespace {

constexpr double max_samples = 1e6;

void check_moves(const std::vector<Keyframe>& moves, const std::string& key,
                 const std::string& file) {
    for (std::size_t i = 0; i < moves.size(); ++i) {
        const double last = i > 0 ? moves[i - 1].at_s : 0;
        if (!(moves[i].at_s > last))
            fail("{}moves[{}].at_s = {} s must be after {} s, where the move before it ends ({})",
                 key, i, moves[i].at_s, last, file);
    }
}

void check(const MotionScript& script, const std::string& file) {
    if (script.rate_Hz * script.duration_s > max_samples)
        fail("rate_Hz = {} Hz for duration_s = {} s must be at most {} samples ({})",
             script.rate_Hz, script.duration_s, max_samples, file);
    if (script.tools.empty())
        fail("tools is missing, expected at least one, such as - tool: Sensor ({})", file);
    check_moves(script.organ.moves, "organ.", file);
    std::set<std::string> names;
    for (std::size_t i = 0; i < script.tools.size(); ++i) {
        const ScriptedTool& tool = script.tools[i];
        check_moves(tool.moves, fmt::format("tools[{}].", i), file);
        if (!names.insert(tool.tool).second)
            fail("tools[{}].tool = {} is there twice, expected each tool once ({})", i, tool.tool,
                 file);
    }
}

/// Displacement and rotation vector relative to 0 s.
Keyframe move_at(const std::vector<Keyframe>& moves, double time_s) {
    Keyframe from, to;
    for (const Keyframe& next : moves) {
        from = to;
        to = next;
        if (time_s < to.at_s) break;
    }
    const double done =
        to.at_s > from.at_s ? smooth_step((time_s - from.at_s) / (to.at_s - from.at_s)) : 1;
    return {time_s, from.by_mm + done * (to.by_mm - from.by_mm),
            from.turn_deg + done * (to.turn_deg - from.turn_deg)};
}

/// Pose of a body in its parent frame.
template <class Frame, class Body>
RigidTransform<Frame, Body> place_of(const ScriptedBody& body, double time_s) {
    const Keyframe move = move_at(body.moves, time_s);
    return {rotation_of_vector(radians_per_degree * move.turn_deg) *
                rotation_of_vector(radians_per_degree * body.turn_deg),
            1e-3 * (body.at_mm + move.by_mm)};
}

RigidTransform<Tracker, Tool> tracker_from_tool(const MotionScript& script,
                                                const ScriptedTool& tool, double time_s) {
    const RigidTransform<Tool, Tip> tool_from_tip{Eigen::Matrix3d::Identity(), 1e-3 * tool.tip_mm};
    const auto tracker_from_tip = tool.on == ScriptFrame::organ
                                      ? place_of<Tracker, ImageFrame>(script.organ, time_s) *
                                            place_of<ImageFrame, Tip>(tool, time_s)
                                      : place_of<Tracker, Tip>(tool, time_s);
    return tracker_from_tip * tool_from_tip.inverse();
}

bool is_lost(const ScriptedTool& tool, double time_s) {
    for (std::size_t i = 0; i + 1 < tool.lost_s.size(); i += 2)
        if (time_s >= tool.lost_s[i] && time_s < tool.lost_s[i + 1]) return true;
    return false;
}

/// Whether sample `i` is the first at or after one of the tool's jump times.
bool jumps(const ScriptedTool& tool, std::size_t i, double rate_Hz) {
    return std::ranges::any_of(tool.jump_s, [&](double t) {
        return std::ceil(t * rate_Hz - 1e-6) == static_cast<double>(i);
    });
}

}  // namespace

MotionScript parse_motion_script(const std::string& text, const std::string& file) {
    MotionScript script = read_yaml<MotionScript>(text, file);
    check(script, file);
    return script;
}

DelayedRecording simulate(const MotionScript& script) {
    const auto seed = static_cast<std::uint64_t>(script.seed);
    TrackerNoise noise(1e-3 * script.position_noise_mm,
                       radians_per_degree * script.rotation_noise_deg, seed);
    // Separate from the noise's engine, so that latency options do not change the noise.
    std::mt19937_64 engine(~seed);
    std::bernoulli_distribution drops(script.dropout_rate);
    std::normal_distribution<double> normal;
    DelayedRecording result;
    for (const ScriptedTool& tool : script.tools) result.recording.tools.push_back(tool.tool);
    const auto samples =
        static_cast<std::size_t>(std::floor(script.duration_s * script.rate_Hz + 1e-9)) + 1;
    for (std::size_t i = 0; i < samples; ++i) {
        TrackerSample& sample = result.recording.samples.emplace_back();
        sample.time_s = static_cast<double>(i) / script.rate_Hz;
        for (const ScriptedTool& tool : script.tools) {
            TrackedPose pose = noise(pose_of(tracker_from_tool(script, tool, sample.time_s)));
            if (jumps(tool, i, script.rate_Hz)) pose.translation += 1e-3 * tool.jump_mm;
            const bool dropped = drops(engine);
            sample.poses.push_back(dropped || is_lost(tool, sample.time_s) ? TrackedPose{} : pose);
        }
        const double late_ms = script.latency_ms + script.latency_jitter_ms * normal(engine);
        result.delays_s.push_back(1e-3 * std::max(0.0, late_ms));
    }
    return result;
}

}  // namespace livetet
