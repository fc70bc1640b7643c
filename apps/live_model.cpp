#include "apps/live_model.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "mesh/quadratic.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

PoseFilterOptions filter_options(const TrackOptions& track) {
    PoseFilterOptions options;
    options.enabled = track.smoothing_Hz > 0;
    if (options.enabled) options.min_cutoff_Hz = track.smoothing_Hz;
    return options;
}

}  // namespace

LiveModel::LiveModel(const Scene& scene, SceneBody& body, const std::vector<std::string>& tools,
                     const RigidTransform<ImageFrame, Reference>& image_from_reference)
    : scene_(scene),
      body_(body),
      reference_(tool_index({tools, {}}, scene.track->reference_tool)),
      sensor_(tool_index({tools, {}}, scene.track->sensor_tool)),
      reference_filter_(filter_options(*scene.track)),
      sensor_filter_(filter_options(*scene.track)),
      registration_(image_from_reference),
      drive_({.motion = scene.track->motion, .base_window_s = scene.track->base_window_s}),
      constraints_(body.mesh().nodes.size()) {
    SceneConstraints scene_constraints(scene, body.mesh());
    scene_constraints.move_to_share(1);
    constraints_ = scene_constraints.constraints();
    body_.body->set_constraints(constraints_);
    body_.body->set_springs(scene_constraints.springs());
    body_.body->set_external_force(scene_forces(scene, body.mesh()));
    // Not a number until the reference sensor was first seen.
    frame_.tracker_from_image.rotation.setConstant(std::nan(""));
    frame_.tracker_from_image.translation.setConstant(std::nan(""));
    frame_.displacement.assign(body.mesh().nodes.size(), Vector3::Zero());
}

void LiveModel::follow(const TrackerSample& sample) {
    const auto reference = reference_gate_.update(sample.time_s, sample.poses[reference_]);
    const auto sensor = sensor_gate_.update(sample.time_s, sample.poses[sensor_]);
    frame_.registration = registration_.update(sample.time_s, reference_filter_.update(sample.time_s, reference.pose));
    if (registration_.image_from_tracker()) frame_.tracker_from_image = registration_.image_from_tracker()->inverse();

    // The sensor in the image, by the unfiltered poses of one moment: in their product the organ's own motion cancels,
    // so that the filter, which follows, sees the press alone and does not lag behind a moving patient.
    std::optional<RigidTransform<ImageFrame, Sensor>> image_from_sensor;
    if (reference.verdict == GateVerdict::accepted && sensor.verdict == GateVerdict::accepted) {
        const auto raw = registration_.image_from_reference() * tracker_from<Reference>(reference.pose).inverse() *
                         tracker_from<Sensor>(sensor.pose);
        const TrackedPose smooth =
            sensor_filter_.update(sample.time_s, {raw.rotation, raw.translation, PoseStatus::ok});
        image_from_sensor = {smooth.rotation, smooth.translation};
    }
    frame_.drive = drive_.update(sample.time_s, image_from_sensor);
}

void LiveModel::place_patch() {
    const Vector3 place = drive_.base()->translation;
    patch_ = surface_patch(body_.mesh(), place, scene_.track->patch_radius_mm / 1e3);
    patch_.nodes = with_edge_nodes_between(body_.mesh(), patch_.nodes);
    if (patch_.distance > 0.02)
        fail(
            "track.sensor_tool = {}: when placed, the sensor is at ({:.1f}, {:.1f}, {:.1f}) mm in the image, {:.1f} mm "
            "off the organ's surface, expected at most 20 mm: is the registration of this recording?",
            scene_.track->sensor_tool, 1e3 * place.x(), 1e3 * place.y(), 1e3 * place.z(), 1e3 * patch_.distance);
    for (const std::int32_t n : patch_.nodes)
        if (constraints_.components[n] == 0) driven_.push_back(n);
    constraints_.prescribe(driven_, Vector3::Zero());
    driven_to_.resize(driven_.size());
    body_.body->set_constraints(constraints_);
}

void LiveModel::move_patch() {
    if (patch_.nodes.empty()) place_patch();
    for (std::size_t k = 0; k < driven_.size(); ++k) driven_to_[k] = drive_.displacement(body_.mesh().nodes[driven_[k]]);
    body_.body->move_constraints(driven_, driven_to_);
    frame_.press = drive_.displacement(body_.mesh().nodes[patch_.centre]).norm();
}

const Frame& LiveModel::advance(const TrackerSample& sample, FrameLimits limits) {
    const auto seconds_since = [](Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); };
    const auto start = Clock::now();
    frame_.time_s = sample.time_s;
    follow(sample);
    if (drive_.base()) move_patch();
    frame_.sensor_s = seconds_since(start);
    const double dt = last_time_s_ ? sample.time_s - *last_time_s_ : scene_.time.step_s;
    last_time_s_ = sample.time_s;
    if (!(dt > 0)) return frame_;
    if (limits.deadline) *limits.deadline -= std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(tail_s_));
    frame_.step = body_.body->step(dt, {.linearisations = scene_.track->linearisations,
                                        .linear_tolerance = scene_.solver.relative_tolerance,
                                        .iterations = limits.iterations,
                                        .deadline = limits.deadline,
                                        .by_halves = limits.by_halves});
    const auto stepped = Clock::now();
    body_.body->displacement(frame_.displacement);
    frame_.output_s = seconds_since(stepped);
    tail_s_ = std::max(0.95 * tail_s_, frame_.step.finish_s + frame_.output_s);
    return frame_;
}

}  // namespace livetet
