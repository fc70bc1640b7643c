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

Vector3 mean_place(const MeshPart& part, std::span<const std::int32_t> nodes) {
    std::array<double, 3> sum{};
    for (const std::int32_t n : nodes)
        if (n < part.owned()) Vector3::Map(sum.data()) += part.mesh().nodes[n];
    part.sum(sum);
    return Vector3::Map(sum.data()) / static_cast<double>(part.count(nodes));
}

}  // namespace

SceneConstraints::SceneConstraints(const Scene& scene, const MeshPart& part)
    : comm_(part.comm()), owned_(part.owned()), constraints_(part.mesh().nodes.size()) {
    for (std::size_t i = 0; i < scene.drive.size(); ++i) {
        const DriveOptions& d = scene.drive[i];
        const std::string key = fmt::format("drive[{}]", i);
        const std::vector<std::int32_t> nodes = select_nodes(part, d, key);
        const Vector3 centre = d.centre_mm ? *d.centre_mm / 1e3 : mean_place(part, nodes);
        TrackerNoise noise(d.noise_mm / 1e3, 0, static_cast<std::uint64_t>(d.noise_seed));
        const Vector3 error = noise(TrackedPose{}).translation;
        add({.key = key,
             .nodes = nodes,
             .displacement = d.displacement_mm / 1e3 + error,
             .turn = d.rotation_deg * (std::numbers::pi / 180),
             .components = component_bits(d.components),
             .stiffness = d.stiffness_N_per_m,
             .ramp_s = d.ramp_s},
            part, centre);
    }
    for (std::size_t i = 0; i < scene.fix.size(); ++i) {
        const FixOptions& f = scene.fix[i];
        const std::string key = fmt::format("fix[{}]", i);
        add({.key = key,
             .nodes = select_nodes(part, f, key),
             .components = component_bits(f.components),
             .stiffness = f.stiffness_N_per_m},
            part);
    }
    if (std::vector<std::int32_t> resting = resting_nodes(scene, part.mesh()); !resting.empty())
        add({.key = "free_pieces", .nodes = std::move(resting)}, part);
    move_to_share(0);
}

void SceneConstraints::add(Driven d, const MeshPart& part, const Vector3& centre) {
    const std::vector<Vector3>& places = part.mesh().nodes;
    for (const std::int32_t n : d.nodes) d.arms.push_back(places[n] - centre);
    if (d.stiffness) {
        d.shares = shares_of_nodes(part, d.nodes);
        springs_.stiffness.resize(places.size(), 0);
        springs_.target.resize(places.size(), Vector3::Zero());
        for (std::size_t k = 0; k < d.nodes.size(); ++k)
            springs_.stiffness[d.nodes[k]] += *d.stiffness * d.shares[k];
    }
    driven_.push_back(std::move(d));
}

void SceneConstraints::move(Driven& d, double share) {
    d.values.clear();
    const Eigen::Matrix3d turned = rotation_of_vector(share * d.turn) - Eigen::Matrix3d::Identity();
    for (std::size_t k = 0; k < d.nodes.size(); ++k) {
        const std::int32_t n = d.nodes[k];
        const Vector3 value = turned * d.arms[k] + share * d.displacement;
        d.values.push_back(value);
        if (d.stiffness)  // the springs of overlapping soft sets pull together, to their mean
            springs_.target[n] += *d.stiffness * d.shares[k] / springs_.stiffness[n] * value;
        else
            constraints_.prescribe(std::span(&n, 1), value, d.components);
    }
}

std::vector<std::pair<std::string, Vector3>> SceneConstraints::forces(
    std::span<const Vector3> reactions, std::span<const Vector3> displacement) const {
    std::vector<std::pair<std::string, Vector3>> forces;
    std::vector<std::uint8_t> counted(reactions.size(), 0);
    for (auto d = driven_.rbegin(); d != driven_.rend(); ++d) {
        Vector3 force = Vector3::Zero();
        for (std::size_t k = 0; k < d->nodes.size(); ++k) {
            const std::int32_t n = d->nodes[k];
            if (n >= owned_) continue;  // its owner counts it
            if (d->stiffness) {
                force += *d->stiffness * d->shares[k] * (d->values[k] - displacement[n]);
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
        if (comm_ != MPI_COMM_SELF) sum_over_ranks(comm_, {force.data(), 3});
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

void check_no_free_motion(const Scene& scene, const MeshPart& part, const LevelPieces& pieces,
                          const SceneConstraints& constraints) {
    if (scene.time.is_dynamic()) return;
    std::vector<std::uint8_t> held = constraints.constraints().components;
    for (std::size_t n = 0; n < constraints.springs().stiffness.size(); ++n)
        if (constraints.springs().stiffness[n] > 0) held[n] = 7;
    std::vector<RigidMotionConstraints> of_piece = pieces.unconstrained();
    for (std::int32_t n = 0; n < part.owned(); ++n)
        if (held[n]) of_piece[pieces.of_node[n]].constrain(part.mesh().nodes[n], held[n]);
    sum_over_ranks(part.comm(), of_piece);
    std::vector<FreeMotion> free;
    for (std::size_t p = 0; p < of_piece.size(); ++p) {
        const std::vector<FreeMotion> more = free_motions(
            of_piece[p], of_piece.size() == 1
                             ? ""
                             : fmt::format(" of the piece with node {}", pieces.all[p].node));
        free.insert(free.end(), more.begin(), more.end());
    }
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

void check_no_free_motion(const Scene& scene, const TetMesh& whole,
                          const SceneConstraints& constraints) {
    if (!scene.time.is_dynamic())
        check_no_free_motion(scene, whole, level_pieces(whole), constraints);
}

}  // namespace livetet
