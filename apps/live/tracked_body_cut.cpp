#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <utility>

#include "apps/live/listed_scene.hpp"
#include "apps/live/released_piece.hpp"
#include "apps/live/tracked_body.hpp"
#include "apps/scene/cuts.hpp"
#include "apps/scene/node_selection.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "base/stopwatch.hpp"
#include "solvers/nonlinear/doubled_nodes.hpp"
#include "tracking/poses.hpp"

namespace livetet {

void TrackedBody::check_ten_node_tets_can_be_cut() const {
    if (body_.mesh().edge_nodes.empty()) return;
    const LinearSolver& solver = body_.body->linear_solver();
    if (solver.is_mixed()) refuse_blade_in_mixed_form();
    if (body_.hierarchy.levels.size() < 2)
        fail(
            "elements = P2: found with a blade (track.tools: blade_mm, or track.cut_by_hand_mm) "
            "and the solver {}, expected P1, or solver.kind: live",
            solver.name());
}

void TrackedBody::begin_cutting() {
    check_ten_node_tets_can_be_cut();
    Scene listed = listed_scene(scene_, body_.mesh());
    // Selections are listed: to carry the triangles of the whole surface to each opened mesh would
    // only take time.
    for (TetMesh& level : body_.hierarchy.levels) level.triangle_sets.erase(surface_before_cuts);
    listed.solver.threads = body_.body->threads();  // as long as the run lasts
    cutting_ = std::make_unique<Cutting>(
        Cutting{BladeCuts(linear_levels(body_.hierarchy.levels), scene_.track->cut_interval_s),
                std::move(listed)});
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
/// moves both cancels. Only while the reference is seen: a cut cannot be undone. Cuts the body as
/// it was shown last.
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
    c.cuts.follow(sample.time_s, c.edges, body_.mesh(), frame_.displacement);
}

void TrackedBody::cut_by_hand(std::shared_ptr<const HandCut> cut) {
    frame_.hand_cut = std::move(cut);
}

void TrackedBody::follow_hand_cut() {
    if (!frame_.hand_cut) return;
    if (!cutting_->cuts.cut_along(frame_.time_s, frame_.hand_cut->edges, body_.mesh(),
                                  frame_.displacement))
        log_warning("the line that was drawn parts no cells of the body");
}

void TrackedBody::cut_by_blades() {
    Cutting& c = *cutting_;
    c.replaced.reset();  // as a rule prepare_cut did
    const bool has_told = std::exchange(frame_.blade_gaps, c.cuts.gaps()).count > 0;
    if (frame_.blade_gaps.count > 0 && !has_told)
        log_warning(fmt::format(
            "a blade moved {:.0f} mm in the organ between two samples in which it was seen, too "
            "far or too late to be cut (limits: 20 mm; 0.25 s unseen, 0.5 s without a sample). "
            "Status line and report count such gaps",
            1e3 * frame_.blade_gaps.length));
    if (c.cuts.is_due(frame_.time_s)) {
        const double opens_s = c.cuts.begin();
        c.opening = std::make_unique<CutOpening>(
            c.cuts,
            UncutBody{body_, c.listed, frame_.cut, stating_.statement.get(),
                      stating_.for_slips.get()},
            opens_s);
    }
    if (c.opening && frame_.time_s >= c.opening->opens_s()) open_cut();
    frame_.cut_waits = c.cuts.is_waiting();
}

bool TrackedBody::prepare_cut(const std::function<bool()>& is_over) {
    if (!cutting_) return true;
    cutting_->replaced.reset();
    return !cutting_->opening || cutting_->opening->prepare(is_over);
}

/// What it was prepared for changes: it begins once more.
void TrackedBody::restart_opening() {
    if (!cutting_ || !cutting_->opening) return;
    cutting_->opening.reset();
    cutting_->cuts.restart();
}

void TrackedBody::open_cut() {
    Stopwatch watch;
    const auto opening = std::move(cutting_->opening);
    std::unique_ptr<CutBody> made = opening->finish();
    if (!made) return;
    CutMesh& cut = *made->cut;
    if (frame_.cut) {
        cut.openings = frame_.cut->openings;
        cut.longest_s = frame_.cut->longest_s;
        cut.prepared_s = frame_.cut->prepared_s;
    }
    ++cut.openings;
    cut.parted = cutting_->cuts.parted();
    cut.prepared_s = std::max(cut.prepared_s, opening->prepared_s());
    carry_state(*body_.body, *made->body.body, made->nodes);
    std::swap(body_.body, made->body.body);
    std::swap(body_.hierarchy, made->body.hierarchy);
    cutting_->listed = std::move(made->listed);
    continue_on_mesh(*made);
    cut.longest_s = std::max(cut.longest_s, watch.lap());
    frame_.cut = made->cut;
    cutting_->replaced = std::move(made);
}

/// Takes all that has to do with nodes over to the new mesh.
void TrackedBody::continue_on_mesh(CutBody& made) {
    scene_constraints_ = std::move(made.constraints);
    carry_values(frame_.displacement, made.nodes);
    surface_ = std::move(made.surface);
    for (Sensor& s : sensors_) {
        s.patch.follow_cut(made.first, made.nodes);
        s.patch.leave_ring_out();
    }
    if (settling_) add_copies_to(*settling_, made);
    driven_.nodes.clear();
    driven_.slot.assign(body_.mesh().nodes.size(), -1);
    take_free_pieces(made.free);
    take_constraints();
    pulled_ = true;  // springs are rebuilt
    if (!stating_.statement && !stating_.for_slips) return;
    stating_.is_outdated = true;
    stating_.fix = std::move(made.fix);
    if (made.statement) stating_.statement->set_mesh(std::move(*made.statement));
    if (made.for_slips) *stating_.for_slips = std::move(*made.for_slips);
}

void TrackedBody::add_copies_to(Settling& settling, const CutBody& made) {
    const std::vector<std::int32_t>& originals = made.nodes.originals;
    for (std::size_t k = 0; k < originals.size(); ++k) {
        const auto at = std::ranges::find(settling.nodes, originals[k]);
        if (at == settling.nodes.end()) continue;
        const auto i = at - settling.nodes.begin();
        settling.nodes.push_back(static_cast<std::int32_t>(made.first + k));
        settling.from.push_back(Vector3(settling.from[i]));
        settling.now.push_back(Vector3(settling.now[i]));
    }
}

/// Whether a fixed or driven node, or a spring of the scene, is on a piece.
bool TrackedBody::is_held(std::span<const std::int32_t> piece) const {
    const Constraints& fixed = scene_constraints_->constraints();
    const Springs& springs = scene_constraints_->springs();
    return std::ranges::any_of(piece, [&](std::int32_t n) {
        return fixed.components[n] != 0 || (!springs.empty() && springs.stiffness[n] > 0);
    });
}

/// Tells of pieces that are new. In static scenes what nothing holds stays where it is, as no
/// equation says where else; a sensor on it carries it.
void TrackedBody::take_free_pieces(const std::vector<MeshPiece>& free) {
    const bool are_moving = scene_.time.is_dynamic();
    std::vector<MeshPiece> moving, resting, carried, set_back;
    cutting_->free.clear();
    for (const MeshPiece& piece : free) {
        std::vector<std::int32_t> nodes = nodes_of_pieces({&piece, 1}, body_.mesh());
        const bool is_new = cutting_->told.emplace(piece.cells.front(), piece.cells.size()).second;
        std::vector<MeshPiece>* kind = &resting;
        if (are_moving)
            kind = &moving;
        else if (is_carried(nodes))
            kind = &carried;
        else if (is_new && !is_held(nodes) &&
                 !release_piece(piece, body_.mesh(), frame_.displacement))
            kind = &set_back;
        if (is_new) kind->push_back(piece);
        if (!are_moving) cutting_->free.push_back({std::move(nodes)});
    }
    const auto tell = [](const std::vector<MeshPiece>& pieces, const char* what) {
        if (!pieces.empty())
            log_warning(fmt::format("a cut freed {}; {}", pieces_text(pieces), what));
    };
    tell(moving, "what it freed moves freely");
    tell(resting, "what it freed rests where it is, in a static scene");
    tell(carried, "what it freed goes with the sensor on it");
    tell(set_back,
         "it had hung by so little that it was drawn out far, and is set back to its place in the "
         "image");
}

}  // namespace livetet
