#include <algorithm>
#include <numbers>
#include <utility>

#include "apps/live/listed_scene.hpp"
#include "apps/live/tracked_body.hpp"
#include "apps/scene/cuts.hpp"
#include "apps/scene/scene_forces.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "base/stopwatch.hpp"
#include "mesh/cut_hierarchy.hpp"
#include "mesh/quadratic.hpp"
#include "solvers/nonlinear/doubled_nodes.hpp"
#include "tracking/poses.hpp"

namespace livetet {

void TrackedBody::begin_cutting() {
    Scene listed = listed_scene(scene_, body_.mesh());
    listed.solver.threads = body_.body->threads();  // as long as the run lasts
    cutting_ = std::make_unique<Cutting>(Cutting{
        BladeCuts(body_.hierarchy.levels, scene_.track->cut_interval_s), std::move(listed)});
}

namespace {

/// For the pose of one tool relative to another, each with this noise.
PoseFollowerOptions of_two_tools(PoseFollowerOptions options) {
    options.estimator.position_rms *= std::numbers::sqrt2;
    options.estimator.rotation_rms *= std::numbers::sqrt2;
    return options;
}

}  // namespace

/// Takes the poses of blade and reference sensor at the same time, as sensors on the organ do: what
/// moves both cancels. Only while the reference is seen: a cut cannot be undone.
void TrackedBody::follow_blades(
    const TrackerSample& sample,
    const std::optional<RigidTransform<Tracker, Reference>>& tracker_from_reference) {
    Cutting& c = *cutting_;
    c.edges.clear();
    const bool is_valid = frame_.registration == RegistrationStatus::valid;
    for (std::size_t i = 0; i < shown_.size(); ++i) {
        if (!shown_[i].blade) continue;
        const std::size_t blade = c.edges.size();
        std::optional<BladeEdge>& edge = c.edges.emplace_back();
        if (c.followers.size() <= blade)
            c.followers.emplace_back(of_two_tools(pose_follower_options(*scene_.track)));
        TrackedPose measured;
        if (tracker_from_reference && shown_[i].pose < sample.poses.size() &&
            is_usable(sample.poses[shown_[i].pose])) {
            const auto image_from_tool = registration_.image_from_reference() *
                                         tracker_from_reference->inverse() *
                                         tracker_from<Tool>(sample.poses[shown_[i].pose]);
            measured = {image_from_tool.rotation, image_from_tool.translation, PoseStatus::ok};
        }
        const auto followed = c.followers[blade].update(sample.time_s, measured, 0.0);
        if (!is_valid || !is_usable(followed.unfiltered) || !is_usable(followed.pose)) continue;
        const auto image_from_tip =
            RigidTransform<ImageFrame, Tool>{followed.pose.rotation, followed.pose.translation} *
            tips_[i];
        edge = BladeEdge{image_from_tip * (*shown_[i].blade)[0],
                         image_from_tip * (*shown_[i].blade)[1]};
    }
}

void TrackedBody::cut_by_blades() {
    cutting_->cuts.follow(frame_.time_s, cutting_->edges, body_.mesh(), frame_.displacement);
    if (cutting_->cuts.is_due(frame_.time_s)) open_cuts();
}

void TrackedBody::open_cuts() {
    Stopwatch watch;
    BladeCuts& cuts = cutting_->cuts;
    OpenedLevels opened = cuts.open(body_.hierarchy.levels);
    const std::vector<std::int32_t>& originals = opened.nodes.originals;
    if (originals.empty()) return cuts.put_off();
    const std::size_t first = body_.mesh().nodes.size();
    Scene listed = cutting_->listed;
    add_copies_to_lists(listed, first, originals);
    const HeldPieces pieces = held_pieces(listed, opened.levels.front());
    if (!pieces.is_any_left) {
        cuts.undo();
        log_warning(
            "a blade's cut is not made: it would free the whole body, expected one that leaves a "
            "piece that fix or drive holds and that can deform");
        return;
    }
    if (!make_body_on(opened, listed)) return cuts.undo();
    cuts.keep();
    cutting_->listed = std::move(listed);
    auto cut = std::make_shared<CutMesh>();
    if (frame_.cut) *cut = {{}, frame_.cut->originals, frame_.cut->openings};
    cut->mesh = body_.mesh();
    cut->originals.insert(cut->originals.end(), originals.begin(), originals.end());
    ++cut->openings;
    cut->parted = cuts.parted();
    cut->pieces = pieces.count;
    cut->free_pieces = pieces.free.size();
    const double longest_s = frame_.cut ? frame_.cut->longest_s : 0;
    continue_on_mesh(first, opened.nodes, pieces.free);
    cut->longest_s = std::max(longest_s, watch.lap());
    frame_.cut = std::move(cut);
}

/// Replaces the body by one on the opened mesh, with its state. Returns false, and logs why, if
/// there can be none: then the old one stays.
bool TrackedBody::make_body_on(OpenedLevels& opened, const Scene& listed) {
    try {
        SceneBody fresh = make_body(
            PETSC_COMM_SELF, listed,
            with_cut_transfers(std::move(opened.levels), body_.hierarchy.provenance), Use::track);
        carry_state(*body_.body, *fresh.body, opened.nodes);
        body_.body = std::move(fresh.body);  // first: the old one refers to the old mesh
        body_.hierarchy = std::move(fresh.hierarchy);
        return true;
    } catch (const Error& error) {
        log_warning(fmt::format("a blade's cut is not made: {}", error.what()));
        return false;
    }
}

/// Takes all that has to do with nodes over to the new mesh. `first`: number of the first copy.
void TrackedBody::continue_on_mesh(std::size_t first, const OpenedNodes& nodes,
                                   const std::vector<MeshPiece>& free) {
    const std::vector<std::int32_t>& originals = nodes.originals;
    const TetMesh& mesh = body_.mesh();
    const Scene& listed = cutting_->listed;
    scene_constraints_.emplace(listed, mesh);
    scene_constraints_->move_to_share(1);
    carry_values(frame_.displacement, nodes);
    surface_ = surface_nodes(mesh);
    for (Sensor& s : sensors_) {
        s.patch.follow_cut(first, nodes);
        s.patch.leave_ring_out();
    }
    if (settling_)
        for (std::size_t k = 0; k < originals.size(); ++k) {
            const auto at = std::ranges::find(settling_->nodes, originals[k]);
            if (at == settling_->nodes.end()) continue;
            const auto i = at - settling_->nodes.begin();
            settling_->nodes.push_back(static_cast<std::int32_t>(first + k));
            settling_->from.push_back(Vector3(settling_->from[i]));
            settling_->now.push_back(Vector3(settling_->now[i]));
        }
    driven_.nodes.clear();
    driven_.slot.assign(mesh.nodes.size(), -1);
    take_free_pieces(free);
    take_constraints();
    pulled_ = true;  // springs are rebuilt
    body_.body->set_external_force(scene_forces(listed, mesh));
    renew_responses_on_mesh(free);
}

/// Tells of pieces that are new. In static scenes what nothing holds stays where it is, as no
/// equation says where else.
void TrackedBody::take_free_pieces(const std::vector<MeshPiece>& free) {
    const bool are_moving = scene_.time.is_dynamic();
    cutting_->resting.clear();
    cutting_->resting_at.clear();
    if (!are_moving) cutting_->resting = nodes_of_pieces(free, body_.mesh());
    for (const std::int32_t n : cutting_->resting)
        cutting_->resting_at.push_back(frame_.displacement[n]);
    std::vector<MeshPiece> fresh;
    for (const MeshPiece& piece : free)
        if (cutting_->told.emplace(piece.cells.front(), piece.cells.size()).second)
            fresh.push_back(piece);
    if (fresh.empty()) return;
    log_warning(fmt::format("a blade cut off {}; {}", pieces_text(fresh),
                            are_moving ? "what it cut off moves freely"
                                       : "what it cut off rests where it is, in a static scene"));
}

std::vector<FixOptions> TrackedBody::fix_of_change(const SceneChange& change) const {
    if (!frame_.cut) return change.fix;
    Scene listed;
    listed.fix = change.fix;
    add_copies_to_lists(listed, frame_.cut->mesh.nodes.size() - frame_.cut->originals.size(),
                        frame_.cut->originals);
    return listed.fix;
}

/// What holds the body in the responses' static solves: there, free pieces need a place, too.
std::vector<FixOptions> TrackedBody::fix_of_responses(const std::vector<MeshPiece>& free) const {
    std::vector<FixOptions> fix = cutting_->listed.fix;
    const TetMesh& mesh = body_.mesh();
    std::vector<std::int32_t> nodes;
    if (scene_.time.is_dynamic()) {
        Scene at_rest = cutting_->listed;
        at_rest.time.scheme = TimeScheme::static_equilibrium;
        nodes = nodes_of_pieces(held_pieces(at_rest, mesh).free, mesh);
    } else {
        nodes = nodes_of_pieces(free, mesh);
    }
    if (!nodes.empty()) fix.emplace_back().nodes.emplace(nodes.begin(), nodes.end());
    return fix;
}

void TrackedBody::renew_responses_on_mesh(const std::vector<MeshPiece>& free) {
    if (!stating_.statement && !stating_.for_slips) return;
    stating_.is_outdated = true;
    stating_.fix = fix_of_responses(free);
    if (stating_.statement)
        stating_.statement->set_mesh(cutting_->listed, body_.hierarchy, body_.mesh());
    else
        stating_.for_slips->set_mesh(cutting_->listed, body_.hierarchy);
}

}  // namespace livetet
