#include "tracking/sensor_patch.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tracking/poses.hpp"

namespace livetet {

namespace {

/// Share of the initial stiffness that a patch has at the end of its release.
constexpr double released_share = 1e-4;

/// Options for reference_from_sensor, given those for one tool, whose errors are p and a (RMS
/// length and angle), and the distance |l| between the two. With errors d and rotation vectors a,
///
///     error of the translation  d_s - d_r - a_r x l,   mean square 2 p^2 + 2/3 a^2 |l|^2
///     error of the rotation     a_s - a_r,             mean square 2 a^2
/// `reference_share`: of the first mean square, the part of d_r and a_r.
PoseFollowerOptions of_product(PoseFollowerOptions options, double distance,
                               double& reference_share) {
    PoseEstimatorOptions& o = options.estimator;
    const double at_distance = std::sqrt(1.0 / 3) * o.rotation_rms * distance;
    const double of_sensor = o.position_rms * o.position_rms;
    o.position_rms = std::numbers::sqrt2 * std::hypot(o.position_rms, at_distance);
    reference_share = 1 - of_sensor / (o.position_rms * o.position_rms);
    o.rotation_rms *= std::numbers::sqrt2;
    return options;
}

/// A response scaled down so that it takes no vector along by more than half. The model's ring lags
/// behind its patch and is not known exactly: what it lacks is at most doubled in the excess.
Eigen::Matrix3d bounded(const Eigen::Matrix3d& response) {
    constexpr double max_share = 0.5;
    const double largest =
        std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>()
                      .computeDirect(response.transpose() * response, Eigen::EigenvaluesOnly)
                      .eigenvalues()
                      .maxCoeff());
    return std::min(1.0, max_share / largest) * response;
}

/// Of a measurement, per axis.
double variance_of(const MotionFilter& filter) {
    return std::pow(filter.noise_ratio() * filter.options().noise_rms, 2) / 3;
}

/// The patch's place on the body at rest: the same point of its triangle.
Eigen::Vector3d at_rest(const TetMesh& rest, const TetMesh& now, const SurfacePatch& patch) {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    double whole = 0;
    for (int k = 0; k < 3; ++k) {
        const std::int32_t next = patch.triangle[(k + 1) % 3], other = patch.triangle[(k + 2) % 3];
        const double share = (now.nodes[next] - patch.at).cross(now.nodes[other] - patch.at).norm();
        place += share * rest.nodes[patch.triangle[k]];
        whole += share;
    }
    return place / whole;
}

}  // namespace

SensorTrouble trouble_of(const TrackedPose& pose, PoseVerdict verdict) {
    if (verdict == PoseVerdict::held) return SensorTrouble::jumped;
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

void SensorPatch::follow(
    double time_s, const TrackedPose& sensor,
    const std::optional<RigidTransform<Tracker, Reference>>& tracker_from_reference,
    const RigidTransform<ImageFrame, Reference>& image_from_reference,
    std::optional<double> ahead_s) {
    std::optional<RigidTransform<ImageFrame, Sensor>> image_from_sensor;
    PoseVerdict verdict = PoseVerdict::unusable;
    if (tracker_from_reference && is_usable(sensor)) {
        const auto options = of_product(
            options_.follower, (sensor.translation - tracker_from_reference->translation).norm(),
            reference_share_);
        if (!follower_) follower_.emplace(options);
        const auto measured =
            image_from_reference * tracker_from_reference->inverse() * tracker_from<Sensor>(sensor);
        const PoseFollower::Result followed = follower_->update(
            time_s, {measured.rotation, measured.translation, PoseStatus::ok}, ahead_s);
        verdict = followed.verdict;
        if (is_usable(followed.unfiltered) && is_usable(followed.pose)) {
            image_from_sensor = {followed.pose.rotation, followed.pose.translation};
            // from the next pose on: the distance of an outlier tells nothing
            follower_->set_noise(options.estimator.position_rms, options.estimator.rotation_rms);
        }
    }
    drive_.update(time_s, slipped_ ? std::nullopt : image_from_sensor);
    if (slipped_ && drive_.status() == DriveStatus::released) give_up_patch();
    trouble_ = trouble_of(sensor, verdict);
    if (trouble_ == SensorTrouble::none && !image_from_sensor)
        trouble_ = SensorTrouble::no_reference;
    if (trouble_ == SensorTrouble::none && drive_.is_restless()) trouble_ = SensorTrouble::restless;
    if (drive_.is_too_far()) trouble_ = SensorTrouble::too_far;
    if (slipped_) trouble_ = SensorTrouble::slipped;
}

void SensorPatch::judge_slip(double time_s, std::span<const Eigen::Vector3d> displacement,
                             const std::optional<Eigen::Matrix3d>& ring_response) {
    if (!options_.may_slip || slipped_ || nodes_.empty() ||
        drive_.status() != DriveStatus::following)
        return;
    const Eigen::Vector3d moved = drive_.displacement(ring_.middle);
    if (ring_response) {
        if (ring_.nodes.empty()) return;
        const Eigen::Matrix3d K = bounded(*ring_response);
        const Eigen::Vector3d now = ring_.interpolate(displacement);
        if (is_ring_moved_) ring_placed_ = now - by_others_ - K * (moved - by_others_);
        is_ring_moved_ = false;
        const Eigen::Matrix3d rest = Eigen::Matrix3d::Identity() - K;
        by_others_ = moved - rest.inverse() * (moved - (now - ring_placed_));
    }
    if (monitor_.update(time_s, moved - by_others_, normal_, deviation())) let_go();
}

void SensorPatch::let_go() {
    if (nodes_.empty() || slipped_) return;
    slipped_ = true;
    ++slips_;
    drive_.stop_holding();
    trouble_ = SensorTrouble::slipped;
}

/// The sensor stays, and must be placed again.
void SensorPatch::give_up_patch() {
    slipped_ = false;
    drive_.reset();
    monitor_.restart();
    nodes_.clear();
    placed_.clear();
    wider_.clear();
    ring_ = {};
    by_others_.setZero();
    is_ring_moved_ = false;
}

/// Of the motion since placement by noise, along an axis, m: that of the estimates, or of the poses
/// as they are measured where no estimate is used.
double SensorPatch::deviation() const {
    if (const auto known = error())
        return std::sqrt((known->own.topLeftCorner<3, 3>().trace() + known->by_reference) / 3);
    return follower_ ? std::sqrt(variance_of(follower_->estimator().state().translation)) : 0;
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
    const SurfaceNeighbourhood around(now, place);
    const SurfacePatch patch = around.patch(options_.radius);
    nodes_ = patch.nodes;
    for (const std::int32_t n : nodes_) placed_.push_back({displacement[n], now.nodes[n]});
    ring_ = surface_ring(around, patch, options_.radius);
    ring_placed_ = ring_.interpolate(displacement);
    centre_ = now.nodes[patch.centre];
    rest_place_ = at_rest(mesh, now, patch);
    off_centre_ = patch.off_centre;
    normal_ = patch.normal;
    find_wider(around, patch.area);
    return patch.distance;
}

void SensorPatch::follow_cut(std::size_t first, const OpenedNodes& opened) {
    const auto place_of = [](const std::vector<std::int32_t>& nodes, std::int32_t n) {
        const auto at = std::ranges::lower_bound(nodes, n);
        return at == nodes.end() || *at != n ? -1 : at - nodes.begin();
    };
    for (const MovedNode& m : opened.moved)
        if (const auto at = place_of(nodes_, m.node); at >= 0) placed_[at].place += m.way;
    // Copies are appended in order: the lists stay sorted, and may hold the original.
    for (std::size_t k = 0; k < opened.originals.size(); ++k) {
        const auto copy = static_cast<std::int32_t>(first + k);
        if (const auto at = place_of(nodes_, opened.originals[k]); at >= 0) {
            placed_.push_back(Placed(placed_[at]));
            nodes_.push_back(copy);
        }
        if (place_of(wider_, opened.originals[k]) >= 0) wider_.push_back(copy);
    }
}

void SensorPatch::find_wider(const SurfaceNeighbourhood& around, double area) {
    constexpr int tries = 20;
    const auto radius_of = [](double a) { return std::sqrt(a / std::numbers::pi); };
    double more = options_.radius_spread;
    wider_by_ = 0;
    // a patch grows by whole nodes: at least by half the spread, or the slope is of single nodes
    for (int k = 0; k < tries && wider_by_ < options_.radius_spread / 2; ++k, more *= 1.5) {
        const SurfacePatch patch = around.patch(options_.radius + more);
        wider_ = patch.nodes;
        wider_by_ = radius_of(patch.area) - radius_of(area);
        if (patch.nodes.size() == around.surface_node_count()) break;  // all of the surface
    }
}

std::optional<PatchError> SensorPatch::error() const {
    if (slipped_ || drive_.status() != DriveStatus::following) return {};
    if (!follower_ || !follower_->used()) return {};
    const PoseEstimator& estimator = follower_->estimator();
    const auto& now = follower_->used()->covariance;
    const double poses = std::max(1, drive_.base_poses());
    const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
    PatchError error;
    error.base = variance_of(estimator.state().translation) / poses * I;  // as of white noise
    error.own.topLeftCorner<3, 3>() =
        error.base + (1 - reference_share_) * now.topLeftCorner<3, 3>();
    error.own.bottomRightCorner<3, 3>() =
        variance_of(estimator.state().rotation) / poses * I + now.bottomRightCorner<3, 3>();
    error.by_reference = reference_share_ * now.topLeftCorner<3, 3>().trace();
    error.base_by_reference = reference_share_ * error.base.trace();
    return error;
}

double SensorPatch::spring_stiffness() const {
    if (nodes_.empty() || is_hard() || drive_.grip() == 0) return 0;
    return options_.stiffness.value_or(options_.firm_stiffness) *
           std::pow(released_share, 1 - drive_.grip());
}

}  // namespace livetet
