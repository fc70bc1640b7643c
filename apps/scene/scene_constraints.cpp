#include "apps/scene/scene_constraints.hpp"

#include <algorithm>
#include <numbers>

#include "apps/scene/cuts.hpp"
#include "apps/scene/node_selection.hpp"
#include "base/error.hpp"
#include "geometry/transform.hpp"
#include "mechanics/rigid_motions.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {

namespace {

std::uint8_t component_bits(const std::string& components) {
    std::uint8_t bits = 0;
    for (const char c : components) bits |= 1 << (c - 'x');
    return bits;
}

}  // namespace

SceneConstraints::SceneConstraints(const Scene& scene, const TetMesh& mesh)
    : constraints_(mesh.nodes.size()) {
    for (std::size_t i = 0; i < scene.drive.size(); ++i) {
        const DriveOptions& d = scene.drive[i];
        const std::string key = fmt::format("drive[{}]", i);
        const std::vector<std::int32_t> nodes = select_nodes(mesh, d, key);
        Vector3 centre = Vector3::Zero();
        for (const std::int32_t n : nodes)
            centre += mesh.nodes[n] / static_cast<double>(nodes.size());
        if (d.centre_mm) centre = *d.centre_mm / 1e3;
        TrackerNoise noise(d.noise_mm / 1e3, 0, static_cast<std::uint64_t>(d.noise_seed));
        const Vector3 error = noise(TrackedPose{}).translation;
        add({.key = key,
             .nodes = nodes,
             .displacement = d.displacement_mm / 1e3 + error,
             .turn = d.rotation_deg * (std::numbers::pi / 180),
             .components = component_bits(d.components),
             .stiffness = d.stiffness_N_per_m,
             .ramp_s = d.ramp_s},
            mesh, centre);
    }
    for (std::size_t i = 0; i < scene.fix.size(); ++i) {
        const FixOptions& f = scene.fix[i];
        const std::string key = fmt::format("fix[{}]", i);
        add({.key = key,
             .nodes = select_nodes(mesh, f, key),
             .components = component_bits(f.components),
             .stiffness = f.stiffness_N_per_m},
            mesh);
    }
    if (std::vector<std::int32_t> resting = resting_nodes(scene, mesh); !resting.empty())
        add({.key = "free_pieces", .nodes = std::move(resting)}, mesh);
    move_to_share(0);
}

void SceneConstraints::add(Driven d, const TetMesh& mesh, const Vector3& centre) {
    for (const std::int32_t n : d.nodes) d.arms.push_back(mesh.nodes[n] - centre);
    d.count = static_cast<double>(d.nodes.size());
    if (d.stiffness) {
        springs_.stiffness.resize(mesh.nodes.size(), 0);
        springs_.target.resize(mesh.nodes.size(), Vector3::Zero());
        for (const std::int32_t n : d.nodes) springs_.stiffness[n] += *d.stiffness / d.count;
    }
    driven_.push_back(std::move(d));
}

void SceneConstraints::restrict_to(const PartitionedMesh& share) {
    shared_ = {share.comm, share.owned};
    std::vector<std::int32_t> local_of(share.total, -1);
    for (std::size_t i = 0; i < share.nodes.size(); ++i)
        local_of[share.nodes[i]] = static_cast<std::int32_t>(i);
    for (Driven& d : driven_) {
        std::vector<std::int32_t> nodes;
        std::vector<Vector3> arms;
        for (std::size_t k = 0; k < d.nodes.size(); ++k) {
            const std::int32_t n = local_of[d.nodes[k]];
            if (n < 0) continue;
            nodes.push_back(n);
            arms.push_back(d.arms[k]);
        }
        d.nodes = std::move(nodes);
        d.arms = std::move(arms);
    }
    constraints_.components = local_part<std::uint8_t>(share, constraints_.components);
    constraints_.values = local_part<Vector3>(share, constraints_.values);
    if (!springs_.empty()) {
        springs_.stiffness = local_part<double>(share, springs_.stiffness);
        springs_.target = local_part<Vector3>(share, springs_.target);
    }
    move_to_share(0);
}

void SceneConstraints::move(Driven& d, double share) {
    d.values.clear();
    const Eigen::Matrix3d turned = rotation_of_vector(share * d.turn) - Eigen::Matrix3d::Identity();
    for (std::size_t k = 0; k < d.nodes.size(); ++k) {
        const std::int32_t n = d.nodes[k];
        const Vector3 value = turned * d.arms[k] + share * d.displacement;
        d.values.push_back(value);
        if (d.stiffness)  // the springs of overlapping soft sets pull together, to their mean
            springs_.target[n] += *d.stiffness / d.count / springs_.stiffness[n] * value;
        else
            constraints_.prescribe(std::span(&n, 1), value, d.components);
    }
}

std::vector<std::pair<std::string, Vector3>> SceneConstraints::forces(
    std::span<const Vector3> reactions, std::span<const Vector3> displacement) const {
    std::vector<std::pair<std::string, Vector3>> forces;
    std::vector<std::uint8_t> counted(reactions.size(), 0);
    const auto owned = shared_ ? shared_->owned : static_cast<std::int32_t>(reactions.size());
    for (auto d = driven_.rbegin(); d != driven_.rend(); ++d) {
        Vector3 force = Vector3::Zero();
        for (std::size_t k = 0; k < d->nodes.size(); ++k) {
            const std::int32_t n = d->nodes[k];
            if (n >= owned) continue;  // its owner counts it
            if (d->stiffness) {
                force += *d->stiffness / d->count * (d->values[k] - displacement[n]);
                continue;
            }
            for (int c = 0; c < 3; ++c) {
                if (!(d->components >> c & 1) || (counted[n] >> c & 1)) continue;
                force[c] += reactions[n][c];
                if (!springs_.empty())
                    force[c] -=
                        springs_.stiffness[n] * (springs_.target[n][c] - displacement[n][c]);
            }
            counted[n] |= d->components;
        }
        if (shared_) sum_over_ranks(shared_->comm, {force.data(), 3});
        forces.emplace_back(d->key, force);
    }
    std::reverse(forces.begin(), forces.end());
    return forces;
}

void SceneConstraints::move_to_time(double time_s) {
    std::fill(springs_.target.begin(), springs_.target.end(), Vector3::Zero());
    for (Driven& d : driven_) move(d, d.ramp_s > 0 ? std::min(1.0, time_s / d.ramp_s) : 1.0);
}

void SceneConstraints::move_to_share(double share) {
    std::fill(springs_.target.begin(), springs_.target.end(), Vector3::Zero());
    for (Driven& d : driven_) move(d, share);
}

void check_no_free_motion(const Scene& scene, const TetMesh& mesh,
                          const SceneConstraints& constraints) {
    if (scene.time.is_dynamic()) return;
    std::vector<std::uint8_t> held = constraints.constraints().components;
    for (std::size_t n = 0; n < constraints.springs().stiffness.size(); ++n)
        if (constraints.springs().stiffness[n] > 0) held[n] = 7;
    const std::vector<FreeMotion> free = free_rigid_motions(mesh, held);
    if (free.empty()) return;
    std::string list;
    for (std::size_t i = 0; i < std::min<std::size_t>(free.size(), 6); ++i)
        list += (i ? ", " : "") + free[i].description;
    if (free.size() > 6) list += ", ...";
    fail(
        "the body is not held: {} rigid motion{} free in a static scene: {}; expected fix or drive "
        "to hold them",
        free.size(), free.size() == 1 ? " is" : "s are", list);
}

}  // namespace livetet
