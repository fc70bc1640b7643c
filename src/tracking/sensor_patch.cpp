#include "tracking/sensor_patch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mesh/quadratic.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

/// Share of the initial stiffness that a patch has at the end of its release.
constexpr double released_share = 1e-4;

}  // namespace

SensorTrouble trouble_of(const TrackedPose& pose, GateVerdict verdict) {
    if (verdict == GateVerdict::held) return SensorTrouble::jumped;
    switch (pose.status) {
        case PoseStatus::ok:
            return is_usable(pose) ? SensorTrouble::none : SensorTrouble::broken;
        case PoseStatus::missing:
            return SensorTrouble::lost;
        case PoseStatus::invalid:
            return SensorTrouble::invalid;
        case PoseStatus::out_of_volume:
            return SensorTrouble::out_of_volume;
        case PoseStatus::stale:
            return SensorTrouble::stale;
        case PoseStatus::broken:
            return SensorTrouble::broken;
    }
    return SensorTrouble::invalid;
}

void SensorPatch::follow(double time_s, const TrackedPose& sensor,
                         const OutlierGate::Result& reference,
                         const RigidTransform<ImageFrame, Reference>& image_from_reference) {
    const auto gated = gate_.update(time_s, sensor);
    std::optional<RigidTransform<ImageFrame, Sensor>> image_from_sensor;
    if (reference.verdict == GateVerdict::accepted && gated.verdict == GateVerdict::accepted) {
        const auto raw = image_from_reference * tracker_from<Reference>(reference.pose).inverse() *
                         tracker_from<Sensor>(gated.pose);
        const TrackedPose smooth =
            filter_.update(time_s, {raw.rotation, raw.translation, PoseStatus::ok});
        image_from_sensor = {smooth.rotation, smooth.translation};
    }
    drive_.update(time_s, image_from_sensor);
    trouble_ = trouble_of(sensor, gated.verdict);
    if (trouble_ == SensorTrouble::none && !image_from_sensor)
        trouble_ = SensorTrouble::no_reference;
    if (trouble_ == SensorTrouble::none && drive_.is_restless()) trouble_ = SensorTrouble::restless;
    if (drive_.is_too_far()) trouble_ = SensorTrouble::too_far;
}

double SensorPatch::place(const TetMesh& mesh, std::span<const std::int32_t> surface,
                          std::span<const Eigen::Vector3d> displacement, double farthest) {
    const Eigen::Vector3d place = drive_.base()->translation;
    double distance = std::numeric_limits<double>::infinity();
    for (const std::int32_t n : surface)
        distance = std::min(distance, (mesh.nodes[n] + displacement[n] - place).norm());
    if (!(distance <= farthest)) {
        drive_.reset();
        return distance;
    }
    TetMesh now = mesh;
    for (std::size_t n = 0; n < now.nodes.size(); ++n) now.nodes[n] += displacement[n];
    const SurfacePatch patch = surface_patch(now, place, options_.radius);
    nodes_ = with_edge_nodes_between(now, patch.nodes);
    for (const std::int32_t n : nodes_) placed_.push_back({displacement[n], now.nodes[n]});
    centre_ = now.nodes[patch.centre];
    return patch.distance;
}

double SensorPatch::spring_stiffness() const {
    if (nodes_.empty() || is_hard() || drive_.grip() == 0) return 0;
    return options_.stiffness.value_or(options_.firm_stiffness) *
           std::pow(released_share, 1 - drive_.grip());
}

}  // namespace livetet
