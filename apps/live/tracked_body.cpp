#include "apps/live/tracked_body.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "io/tip_file.hpp"
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

std::vector<RigidTransform<Tool, Tip>> read_tips(const TrackOptions& track) {
    std::vector<RigidTransform<Tool, Tip>> tips;
    for (const ToolOptions& tool : track.tools)
        tips.push_back(tool.tip.empty() ? RigidTransform<Tool, Tip>{}
                                        : read_tip(tool.tip, tool.tool).tool_from_tip());
    return tips;
}

}  // namespace

SceneChange prepare_change(const Scene& scene, const TetMesh& mesh) {
    SceneChange change{scene, SceneConstraints(scene, mesh), read_tips(*scene.track)};
    change.constraints.move_to_share(1);
    check_no_free_motion(scene, mesh, change.constraints);
    return change;
}

ToolFinder tool_finder(std::vector<std::string> tools) {
    return [recording = Recording{std::move(tools), {}}](const std::string& tool) {
        return tool_index(recording, tool);
    };
}

TrackedBody::TrackedBody(const Scene& scene, SceneBody& body, ToolFinder find_tool,
                         const RigidTransform<ImageFrame, Reference>& image_from_reference,
                         MisplacedSensor misplaced)
    : scene_(scene),
      body_(body),
      find_tool_(std::move(find_tool)),
      misplaced_(misplaced),
      reference_(find_tool_(scene.track->reference_tool)),
      reference_follower_(pose_follower_options(*scene.track)),
      registration_(image_from_reference, scene.track->hold_s),
      constraints_(body.mesh().nodes.size()),
      surface_(surface_nodes(body.mesh())),
      driven_slot_(body.mesh().nodes.size(), -1) {
    SceneChange whole = prepare_change(scene_, body_.mesh());
    scene_constraints_.emplace(std::move(whole.constraints));
    for (const SensorOptions& options : scene_.track->sensors)
        sensors_.push_back(new_sensor(options));
    find_shown(std::move(whole.tips));
    take_constraints();
    body_.body->set_springs(scene_constraints_->springs());
    body_.body->set_external_force(scene_forces(scene, body.mesh()));
    // NaN until the reference sensor is seen for the first time.
    frame_.tracker_from_image.rotation.setConstant(std::nan(""));
    frame_.tracker_from_image.translation.setConstant(std::nan(""));
    frame_.displacement.assign(body.mesh().nodes.size(), Vector3::Zero());
}

double fixed_ahead_s(const TrackOptions& track) {
    if (track.ahead_ms) return track.ahead_ms->number.value_or(0) / 1e3;
    return track.smoothing_Hz.value_or(0) > 0 ? 0.04 : 0;
}

PoseFollowerOptions pose_follower_options(const TrackOptions& track) {
    PoseFollowerOptions options;
    options.estimator.position_rms = track.position_noise_mm / 1e3;
    options.estimator.rotation_rms = track.rotation_noise_deg * radians_per_degree;
    if (!track.smoothing_Hz) {
        options.ahead_s = fixed_ahead_s(track);
        return options;
    }
    PoseFilterOptions& filter = options.filter.emplace();
    filter.enabled = *track.smoothing_Hz > 0;
    if (filter.enabled) filter.min_cutoff_Hz = *track.smoothing_Hz;
    filter.ahead_s = fixed_ahead_s(track);
    return options;
}

SensorPatchOptions sensor_patch_options(const Scene& scene, const SensorOptions& options) {
    const TrackOptions& track = *scene.track;
    SensorPatchOptions patch;
    patch.drive = {.motion = options.motion,
                   .base_window_s = track.base_window_s,
                   .hold_s = track.hold_s,
                   .release_s = track.release_s,
                   .max_displacement = track.max_displacement_mm / 1e3};
    patch.follower = pose_follower_options(track);
    patch.radius = options.patch_radius_mm / 1e3;
    patch.radius_spread = options.patch_spread_mm.value_or(0.15 * options.patch_radius_mm) / 1e3;
    patch.stiffness = options.stiffness_N_per_m;
    patch.may_slip = options.may_slip;
    // A hundred times what a disc of the patch's size meets on a half-space: 2 E a / (1 - nu^2).
    double young = 0;
    for (const Material& m : scene.materials) young = std::max<double>(young, m.young_Pa);
    patch.firm_stiffness = 100 * 2 * young * patch.radius / 0.75;
    return patch;
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
        shown.push_back({tool.tool, !tool.tip.empty(), find_tool_(tool.tool)});
    shown_ = std::move(shown);
    tips_ = std::move(tips);
    frame_.image_from_tool.assign(shown_.size(), {});
    frame_.pose_quality.assign(1 + scene_.track->sensors.size(), {});
    frame_.sensors.assign(scene_.track->sensors.size(), {});
}

void TrackedBody::change(SceneChange&& change) {
    // 1. may throw
    Scene next = scene_;
    next.fix = change.scene.fix;
    next.track->sensors = change.scene.track->sensors;
    next.track->tools = change.scene.track->tools;
    const bool fix_changed = !(next.fix == scene_.fix);
    std::list<Sensor> sensors, leaving;
    for (const SensorOptions& options : next.track->sensors) {
        const auto same = std::find_if(sensors_.begin(), sensors_.end(), [&](const Sensor& s) {
            return !s.leaving && s.options == options;
        });
        if (same == sensors_.end()) sensors.push_back(new_sensor(options));
        (void)find_tool_(options.tool);
    }
    for (const ToolOptions& tool : next.track->tools) (void)find_tool_(tool.tool);

    // 2. does not throw
    scene_ = std::move(next);
    for (const SensorOptions& options : scene_.track->sensors) {
        const auto kept = std::find_if(sensors_.begin(), sensors_.end(), [&](const Sensor& s) {
            return !s.leaving && s.options == options;
        });
        auto at = std::find_if(sensors.begin(), sensors.end(),
                               [&](const Sensor& s) { return s.options == options; });
        leaving.splice(leaving.end(), kept != sensors_.end() ? sensors_ : sensors,
                       kept != sensors_.end() ? kept : at);
    }
    for (Sensor& s : sensors_) s.leaving = true;
    leaving.splice(leaving.end(), sensors_);
    sensors_ = std::move(leaving);
    find_shown(std::move(change.tips));
    stating_.is_outdated = stating_.is_outdated || fix_changed;
    if (fix_changed) {
        std::vector<std::uint8_t> before = scene_constraints_->constraints().components;
        if (settling_)
            for (const std::int32_t n : settling_->nodes)
                before[n] = 0;  // they have not arrived yet
        scene_constraints_.emplace(std::move(change.constraints));
        begin_settling(before);
        pulled_ = true;  // springs are rebuilt
    }
    take_constraints();
}

/// Starts leading nodes to rest that have fixed components now and had not `before`.
void TrackedBody::begin_settling(const std::vector<std::uint8_t>& before) {
    Settling settling;
    const Constraints& now = scene_constraints_->constraints();
    for (std::size_t n = 0; n < before.size(); ++n)
        if (now.components[n] & ~before[n]) {
            settling.nodes.push_back(static_cast<std::int32_t>(n));
            settling.from.push_back(frame_.displacement[n]);
        }
    settling.now = settling.from;
    settling.since_s = frame_.time_s;
    settling_ = std::move(settling);
}

void TrackedBody::follow(const TrackerSample& sample) {
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
}

void TrackedBody::place_patches() {
    for (Sensor& s : sensors_) {
        if (s.leaving || !s.patch.awaits_placement()) continue;
        const Vector3 place = s.patch.drive().base()->translation;
        const double distance =
            s.patch.place(body_.mesh(), surface_, frame_.displacement, farthest_from_organ);
        s.off_organ = distance <= farthest_from_organ ? 0 : distance;
        if (s.by_hand) {
            s.leaving = s.off_organ > 0;
            continue;
        }
        if (s.off_organ > 0 && misplaced_ == MisplacedSensor::refuse && s.patch.slips() == 0)
            fail(
                "track.sensors: {}: when placed, the sensor is at ({:.1f}, {:.1f}, {:.1f}) mm in "
                "the image, {:.1f} mm off "
                "the organ's surface, expected at most {:g} mm: is the registration of this "
                "recording?",
                s.options.tool, 1e3 * place.x(), 1e3 * place.y(), 1e3 * place.z(), 1e3 * distance,
                1e3 * farthest_from_organ);
    }
}

/// Prescribed nodes: those of the scene, and the patches that are not held by springs.
void TrackedBody::take_constraints() {
    constraints_ = scene_constraints_->constraints();
    for (const std::int32_t n : driven_) driven_slot_[n] = -1;
    driven_.clear();
    driven_by_.clear();
    for (Sensor& s : sensors_) {
        s.is_hard = s.patch.is_hard();
        if (!s.is_hard) continue;
        for (const std::int32_t n : s.patch.nodes()) {
            if (constraints_.components[n] != 0) continue;
            if (driven_slot_[n] < 0) {
                driven_slot_[n] = static_cast<std::int32_t>(driven_.size());
                driven_.push_back(n);
                driven_by_.push_back(0);
            }
            ++driven_by_[driven_slot_[n]];
        }
    }
    constraints_.prescribe(driven_, Vector3::Zero());
    driven_to_.assign(driven_.size(), Vector3::Zero());
    body_.body->set_constraints(constraints_);
}

void TrackedBody::move_patches() {
    std::fill(driven_to_.begin(), driven_to_.end(), Vector3::Zero());
    for (const Sensor& s : sensors_) {
        if (!s.is_hard) continue;
        for (std::size_t k = 0; k < s.patch.nodes().size(); ++k)
            if (const std::int32_t slot = driven_slot_[s.patch.nodes()[k]]; slot >= 0)
                driven_to_[slot] += s.patch.target(k) / driven_by_[slot];
    }
    body_.body->move_constraints(driven_, driven_to_);
}

/// Patches held by springs: those of soft sensors, and those being released or taken up again.
void TrackedBody::pull_patches() {
    const bool pull = std::any_of(sensors_.begin(), sensors_.end(),
                                  [](const Sensor& s) { return s.patch.spring_stiffness() > 0; });
    if (!pull && !pulled_) return;
    pulled_ = pull;
    springs_ = scene_constraints_->springs();
    if (!pull) {
        body_.body->set_springs(springs_);
        return;
    }
    springs_.stiffness.resize(driven_slot_.size(), 0);
    springs_.target.resize(driven_slot_.size(), Vector3::Zero());
    for (const Sensor& s : sensors_) {
        const double each = s.patch.spring_stiffness() /
                            static_cast<double>(std::max<std::size_t>(s.patch.nodes().size(), 1));
        if (each == 0) continue;
        for (std::size_t k = 0; k < s.patch.nodes().size();
             ++k) {  // overlapping patches pull to their mean
            double& stiffness = springs_.stiffness[s.patch.nodes()[k]];
            Vector3& target = springs_.target[s.patch.nodes()[k]];
            stiffness += each;
            target += each / stiffness * (s.patch.target(k) - target);
        }
    }
    body_.body->set_springs(springs_);
}

void TrackedBody::settle() {
    if (!settling_) return;
    const double release_s = scene_.track->release_s;
    const double way =
        release_s > 0 ? std::min(1.0, (frame_.time_s - settling_->since_s) / release_s) : 1.0;
    const double left = 1 - way * way * (3 - 2 * way);
    for (std::size_t k = 0; k < settling_->nodes.size(); ++k)
        settling_->now[k] = scene_constraints_->constraints().values[settling_->nodes[k]] +
                            left * settling_->from[k];
    body_.body->move_constraints(settling_->nodes, settling_->now);
    if (way >= 1) settling_.reset();
}

const Frame& TrackedBody::advance(const TrackerSample& sample, FrameLimits limits) {
    const auto start = Clock::now();
    frame_.time_s = sample.time_s;
    frame_.ahead_s = limits.ahead_s.value_or(fixed_ahead_s(*scene_.track));
    follow(sample);
    place_patches();
    std::erase_if(sensors_, [](const Sensor& s) {
        return s.leaving &&
               (s.patch.nodes().empty() || s.patch.drive().status() == DriveStatus::released);
    });
    const bool held_anew = std::any_of(sensors_.begin(), sensors_.end(), [](const Sensor& s) {
        return s.is_hard != s.patch.is_hard();
    });
    if (held_anew) take_constraints();
    move_patches();
    pull_patches();
    settle();
    frame_.sensor_s = seconds_since(start);
    const double dt = last_time_s_ ? std::min(sample.time_s - *last_time_s_, longest_frame_s)
                                   : scene_.time.step_s;
    last_time_s_ = sample.time_s;
    if (!(dt > 0)) return frame_;
    if (limits.deadline)
        *limits.deadline -=
            std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(tail_s_));
    frame_.step = body_.body->advance(dt, {.newton_iterations = scene_.track->newton_iterations,
                                           .linear_tolerance = scene_.solver.relative_tolerance,
                                           .max_iterations = limits.max_iterations,
                                           .deadline = limits.deadline,
                                           .renewal = limits.renewal,
                                           .as_done = limits.as_done});
    const auto stepped = Clock::now();
    body_.body->displacement(frame_.displacement);
    frame_.output_s = seconds_since(stepped);
    const auto read = Clock::now();
    state_errors_of_frame();
    frame_.statement_s = seconds_since(read);
    tail_s_ = std::max(0.95 * tail_s_, frame_.step.finish_s + frame_.output_s + frame_.statement_s);
    return frame_;
}

void TrackedBody::state_errors(std::unique_ptr<ErrorStatement> statement,
                               const std::optional<ExpectedRegistrationError>& registration) {
    stating_ = {std::move(statement), {}, registration, {}, true};
    for (const Target& target : stating_.statement->targets())
        stating_.names.push_back(target.name);
}

void TrackedBody::state_errors_of_frame() {
    if (!stating_.statement) return;
    std::vector<const SensorPatch*>& patches = stating_.patches;
    const auto is_stated = [](const Sensor& s) { return !s.leaving && !s.patch.nodes().empty(); };
    auto known = patches.begin();
    for (const Sensor& s : sensors_)
        if (is_stated(s) && (known == patches.end() || *known++ != &s.patch))
            stating_.is_outdated = true;
    if (stating_.is_outdated || known != patches.end()) {
        patches.clear();
        for (const Sensor& s : sensors_)
            if (is_stated(s)) patches.push_back(&s.patch);
        stating_.statement->start(patches, scene_.fix);
        stating_.is_outdated = false;
    }
    const auto& reference = reference_follower_.used();
    const bool is_valid = frame_.registration == RegistrationStatus::valid;
    std::optional<double> solver_error;
    if (body_.body->linear_solver().kind() == SolverKind::live && frame_.step.converged)
        solver_error = frame_.step.linear_error;
    frame_.statement = stating_.statement->update(
        {.reference = reference && is_valid ? &*reference : nullptr,
         .image_from_reference = registration_.image_from_reference(),
         .registration = stating_.registration ? &*stating_.registration : nullptr,
         .is_unknown_elsewhere = sensors_.empty() || settling_.has_value() ||
                                 !std::ranges::all_of(sensors_, is_stated)},
        patches, frame_.displacement, solver_error);
}

PoseQualities pose_qualities(std::span<const TrackedBody::ShownTool> tools,
                             const FrameState& frame) {
    PoseQualities poses;
    for (std::size_t i = 0; i < std::min(tools.size(), frame.pose_quality.size()); ++i)
        poses[tools[i].tool] = frame.pose_quality[i];
    return poses;
}

}  // namespace livetet
