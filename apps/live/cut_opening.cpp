#include "apps/live/cut_opening.hpp"

#include <algorithm>
#include <utility>

#include "apps/scene/scene_forces.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "base/stopwatch.hpp"
#include "mesh/cut_hierarchy.hpp"
#include "mesh/opened_quadratic.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

std::vector<FixOptions> fix_of_responses(const Scene& listed, const TetMesh& mesh,
                                         const std::vector<MeshPiece>& free) {
    std::vector<FixOptions> fix = listed.fix;
    std::vector<std::int32_t> nodes;
    if (listed.time.is_dynamic()) {
        Scene at_rest = listed;
        at_rest.time.scheme = TimeScheme::static_equilibrium;
        nodes = nodes_of_pieces(held_pieces(at_rest, mesh).free, mesh);
    } else {
        nodes = nodes_of_pieces(free, mesh);
    }
    if (!nodes.empty()) fix.emplace_back().nodes.emplace(nodes.begin(), nodes.end());
    return fix;
}

namespace {

/// Makes a step that is thrown away, in which what is fixed moves by a micrometre: a body's first
/// step makes what all steps need.
void warm_up(CutBody& made) {
    const Vector3 move(0, 0, 1e-6);
    Constraints constraints = made.constraints->constraints();
    constraints.prescribe(nodes_of_pieces(made.free, made.body.mesh()), move);
    std::ranges::fill(constraints.values, move);
    made.body.body->set_constraints(constraints);
    (void)made.body.body->advance(made.listed.time.step_s, {.max_iterations = 1});
}

}  // namespace

CutOpening::CutOpening(BladeCuts& cuts, UncutBody from, double opens_s)
    : cuts_(cuts), from_(std::move(from)), opens_s_(opens_s), task_([this] { make(); }) {}

bool CutOpening::prepare(const std::function<bool()>& is_over) {
    Stopwatch watch;
    const bool is_done = task_.work(is_over);
    prepared_s_ += watch.lap();
    return is_done;
}

std::unique_ptr<CutBody> CutOpening::finish() {
    Stopwatch watch;
    try {
        task_.finish();
    } catch (const Error& error) {
        refusal_ = error.what();
    }
    prepared_s_ += watch.lap();
    if (!refusal_.empty()) {
        log_warning(fmt::format("a cut is not made: {}", refusal_));
        cuts_.undo();
        return nullptr;
    }
    if (made_)
        cuts_.keep();
    else
        cuts_.put_off();
    return std::move(made_);
}

OpenedLevels CutOpening::open_levels() const {
    const std::vector<TetMesh>& levels = from_.body.hierarchy.levels;
    if (levels.front().edge_nodes.empty()) return cuts_.open(levels);
    return with_opened_quadratic(levels, cuts_.open(linear_levels(levels)));
}

void CutOpening::make() {
    OpenedLevels opened = open_levels();
    pause_point();
    if (opened.nodes.originals.empty()) return;
    auto made = std::make_unique<CutBody>();
    made->first = from_.body.mesh().nodes.size();
    made->listed = from_.listed;
    add_copies_to_lists(made->listed, made->first, opened.nodes.originals);
    HeldPieces pieces = held_pieces(made->listed, opened.levels.front());
    pause_point();
    if (!pieces.is_any_left) {
        refusal_ =
            "it would free the whole body, expected one that leaves a piece that fix or drive "
            "holds and that can deform";
        return;
    }
    made->cut = std::make_shared<CutMesh>();
    made->cut->pieces = pieces.count;
    made->cut->free_pieces = pieces.free.size();
    made->free = std::move(pieces.free);
    make_body_of(*made, std::move(opened));
    made_ = std::move(made);
}

void CutOpening::make_body_of(CutBody& made, OpenedLevels&& opened) const {
    made.nodes = std::move(opened.nodes);
    MeshHierarchy levels =
        with_cut_transfers(std::move(opened.levels), from_.body.hierarchy.provenance);
    pause_point();
    made.body = make_body(PETSC_COMM_SELF, made.listed, std::move(levels), Use::track);
    const TetMesh& mesh = made.body.mesh();
    CutMesh& cut = *made.cut;
    pause_point();
    cut.mesh = mesh;
    if (from_.cut) cut.originals = from_.cut->originals;
    cut.originals.insert(cut.originals.end(), made.nodes.originals.begin(),
                         made.nodes.originals.end());
    pause_point();
    made.constraints.emplace(made.listed, mesh);
    made.constraints->move_to_share(1);
    pause_point();
    made.surface = surface_nodes(mesh);
    pause_point();
    made.body.body->set_external_force(scene_forces(made.listed, mesh));
    pause_point();
    warm_up(made);
    if (!from_.statement && !from_.for_slips) return;
    made.fix = fix_of_responses(made.listed, mesh, made.free);
    pause_point();
    if (from_.statement)
        made.statement =
            from_.statement->on_mesh(made.listed, made.body.hierarchy, from_.body.mesh(), mesh);
    else
        made.for_slips = from_.for_slips->on_mesh(made.listed, made.body.hierarchy);
}

}  // namespace livetet
