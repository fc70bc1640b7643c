#include "apps/live/tracked_body.hpp"

#include <algorithm>
#include <cmath>

#include "apps/live/start_state.hpp"
#include "apps/scene/model_limits.hpp"
#include "apps/scene/scene_forces.hpp"
#include "base/stopwatch.hpp"
#include "mesh/quadratic.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

/// Longest time step: after a gap in the samples the body goes on from its state.
constexpr double longest_frame_s = 0.5;

const TrackedPose& pose_of(const TrackerSample& sample, std::size_t tool) {
    static const TrackedPose missing;
    return tool < sample.poses.size() ? sample.poses[tool] : missing;
}

std::optional<BladeEdge> blade_edge_of(const ToolOptions& tool) {
    if (!tool.blade_mm) return {};
    const std::vector<double>& b = *tool.blade_mm;
    return BladeEdge{Vector3(b[0], b[1], b[2]) / 1e3, Vector3(b[3], b[4], b[5]) / 1e3};
}

}  // namespace

ToolFinder tool_finder(std::vector<std::string> tools) {
    return [recording = Recording{std::move(tools), {}}](const std::string& tool) {
        return tool_index(recording, tool);
    };
}

TrackedBody::TrackedBody(const Scene& scene, SceneBody& body, ToolFinder find_tool,
                         const RigidTransform<ImageFrame, Reference>& image_from_reference,
                         MisplacedSensor misplaced)
    : scene_(scene),
      newton_iterations_(newton_iterations_of_frame(scene)),
      body_(body),
      find_tool_(std::move(find_tool)),
      misplaced_(misplaced),
      reference_(find_tool_(scene.track->reference_tool)),
      reference_follower_(pose_follower_options(*scene.track)),
      registration_(image_from_reference, scene.track->hold_s),
      constraints_(body.mesh().nodes.size()),
      surface_(surface_nodes(body.mesh())),
      turned_(body.mesh()) {
    driven_.slot.assign(body.mesh().nodes.size(), -1);
    SceneChange whole = prepare_change(scene_, body_.mesh());
    scene_constraints_.emplace(std::move(whole.constraints));
    stating_.fix = std::move(whole.fix);
    for (const SensorOptions& options : scene_.track->sensors)
        sensors_.push_back(new_sensor(options));
    find_shown(std::move(whole.tips));
    if (has_blades(*scene_.track)) begin_cutting();
    take_constraints();
    body_.body->set_springs(scene_constraints_->springs());
    if (scene_.track->start.empty())
        body_.body->set_external_force(scene_forces(scene, body.mesh()));
    // NaN until the reference sensor is seen for the first time.
    frame_.tracker_from_image.rotation.setConstant(std::nan(""));
    frame_.tracker_from_image.translation.setConstant(std::nan(""));
    frame_.displacement.assign(body.mesh().nodes.size(), Vector3::Zero());
    if (scene_.track->start.empty()) return;
    frame_.displacement = read_start(scene_.track->start, body.mesh());
    hold_at(*body_.body, constraints_, frame_.displacement);
}

TrackedBody::Sensor TrackedBody::new_sensor(const SensorOptions& options) const {
    return {options, find_tool_(options.tool), false, 0,
            SensorPatch(sensor_patch_options(scene_, options))};
}

void TrackedBody::find_shown(std::vector<RigidTransform<Tool, Tip>> tips) {
    std::vector<ShownTool> shown{{scene_.track->reference_tool, false, reference_}};
    for (const SensorOptions& sensor : scene_.track->sensors)
        shown.push_back({sensor.tool, false, find_tool_(sensor.tool)});
    tips.insert(tips.begin(), shown.size(), {});
    for (const ToolOptions& tool : scene_.track->tools)
        shown.push_back({tool.tool, !tool.tip.empty(), find_tool_(tool.tool), blade_edge_of(tool)});
    shown_ = std::move(shown);
    tips_ = std::move(tips);
    frame_.image_from_tool.assign(shown_.size(), {});
    frame_.pose_quality.assign(1 + scene_.track->sensors.size(), {});
    frame_.sensors.assign(scene_.track->sensors.size(), {});
}

void TrackedBody::follow(const TrackerSample& sample, std::span<const TrackerSample> passed) {
    const TrackedPose& measured = pose_of(sample, reference_);
    const PoseFollower::Result reference =
        reference_follower_.update(sample.time_s, measured, frame_.ahead_s);
    std::optional<RigidTransform<Tracker, Reference>> tracker_from_reference;
    if (is_usable(reference.unfiltered))
        tracker_from_reference = tracker_from<Reference>(reference.unfiltered);
    frame_.registration = registration_.update(sample.time_s, reference.pose);
    if (registration_.image_from_tracker())
        frame_.tracker_from_image = registration_.image_from_tracker()->inverse();
    frame_.reference = trouble_of(measured, reference.verdict);
    frame_.pose_quality[0] = reference_follower_.quality();
    frame_.press = 0;
    std::size_t k = 0;
    for (Sensor& s : sensors_) {
        const TrackedPose nowhere;
        if (s.by_hand) {
            follow_hand(s);
            continue;
        }
        s.patch.follow(sample.time_s, s.leaving ? nowhere : pose_of(sample, s.pose),
                       tracker_from_reference, registration_.image_from_reference(),
                       frame_.ahead_s);
        if (!s.leaving) {
            frame_.sensors[k++] = {
                s.pose,      s.patch.drive().status(), s.patch.trouble(), s.patch.press(),
                s.off_organ, s.patch.drive().base()};
            frame_.pose_quality[k] = s.patch.quality();  // after the reference's
        }
        frame_.press = std::max(frame_.press, s.patch.press());
    }
    judge_slips();
    for (std::size_t i = 0; i < shown_.size(); ++i) {
        const TrackedPose& pose = pose_of(sample, shown_[i].pose);
        frame_.image_from_tool[i] = {};
        if (!is_usable(pose) || frame_.registration == RegistrationStatus::lost) continue;
        const auto image_from_tip =
            *registration_.image_from_tracker() * tracker_from<Tool>(pose) * tips_[i];
        frame_.image_from_tool[i] = {image_from_tip.rotation, image_from_tip.translation,
                                     PoseStatus::ok};
    }
    if (!cutting_) return;
    for (const TrackerSample& earlier : passed) {
        const TrackedPose& then = pose_of(earlier, reference_);
        follow_blades(
            earlier, is_usable(then) ? std::optional(tracker_from<Reference>(then)) : std::nullopt);
    }
    follow_blades(sample, tracker_from_reference);
    follow_hand_cut();
}

const Frame& TrackedBody::advance(const TrackerSample& sample, FrameLimits limits,
                                  std::span<const TrackerSample> passed) {
    const auto start = Clock::now();
    frame_.time_s = sample.time_s;
    frame_.ahead_s = limits.ahead_s.value_or(fixed_ahead_s(*scene_.track));
    follow(sample, passed);
    if (cutting_) cut_by_blades();
    place_patches();
    std::erase_if(sensors_, [](const Sensor& s) {
        return s.leaving &&
               (s.patch.nodes().empty() || s.patch.drive().status() == DriveStatus::released);
    });
    if (is_held_anew()) take_constraints();
    move_patches();
    pull_patches();
    settle();
    frame_.sensor_s = seconds_since(start);
    const double dt = last_time_s_ ? std::min(sample.time_s - *last_time_s_, longest_frame_s)
                                   : scene_.time.step_s;
    last_time_s_ = sample.time_s;
    if (!(dt > 0)) return frame_;
    if (limits.deadline) limits.deadline = limits.deadline->earlier_by(tail_s_);
    frame_.step = body_.body->advance(dt, {.newton_iterations = newton_iterations_,
                                           .linear_tolerance = scene_.solver.relative_tolerance,
                                           .max_iterations = limits.max_iterations,
                                           .deadline = limits.deadline,
                                           .renewal = limits.renewal,
                                           .as_done = limits.as_done});
    const auto stepped = Clock::now();
    body_.body->displacement(frame_.displacement);
    frame_.output_s = seconds_since(stepped);
    const auto read = Clock::now();
    turned_.look(body_.mesh(), frame_.displacement);
    frame_.turned_elements = turned_.count();
    state_errors_of_frame();
    frame_.statement_s = seconds_since(read);
    tail_s_ = std::max(0.95 * tail_s_, frame_.step.finish_s + frame_.output_s + frame_.statement_s);
    return frame_;
}

PoseQualities pose_qualities(std::span<const TrackedBody::ShownTool> tools,
                             const FrameState& frame) {
    PoseQualities poses;
    for (std::size_t i = 0; i < std::min(tools.size(), frame.pose_quality.size()); ++i)
        poses[tools[i].tool] = frame.pose_quality[i];
    return poses;
}

}  // namespace livetet
