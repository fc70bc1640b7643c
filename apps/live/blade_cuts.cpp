#include "apps/live/blade_cuts.hpp"

#include <algorithm>
#include <cmath>

namespace livetet {

std::vector<TetMesh> linear_levels(const std::vector<TetMesh>& levels) {
    return {levels.begin() + (levels.front().edge_nodes.empty() ? 0 : 1), levels.end()};
}

void add_copies(std::vector<std::int32_t>& nodes, std::size_t first,
                std::span<const std::int32_t> originals) {
    std::vector<std::int32_t> more;
    const auto is_in = [&](std::int32_t n) {
        return std::ranges::binary_search(nodes, n) || std::ranges::binary_search(more, n);
    };
    for (std::size_t k = 0; k < originals.size(); ++k)
        if (is_in(originals[k])) more.push_back(static_cast<std::int32_t>(first + k));
    nodes.insert(nodes.end(), more.begin(), more.end());
}

BladeCuts::BladeCuts(const std::vector<TetMesh>& levels, double interval_s)
    : cuttable_(openable_mesh(levels)), interval_s_(interval_s) {
    const TetMesh& mesh = levels.front();
    Vector3 low = mesh.nodes.front(), high = low;
    for (const Vector3& x : mesh.nodes) low = low.cwiseMin(x), high = high.cwiseMax(x);
    centre_ = (low + high) / 2;
    size_ = (high - low).norm();
    sweep_options_.longest_edge = cuttable_->cell_edge() / 2;
}

/// Whether it may touch the body: elsewhere nothing is to be carried to rest.
bool BladeCuts::is_near(const BladeEdge& edge, std::span<const Vector3> displacement) const {
    double farthest_moved = 0;
    for (const Vector3& u : displacement)
        farthest_moved = std::max(farthest_moved, u.squaredNorm());
    const double reach = size_ + std::sqrt(farthest_moved) + (edge[1] - edge[0]).norm();
    return (edge[0] - centre_).norm() <= reach && (edge[1] - centre_).norm() <= reach;
}

/// The triangles that may cross a link. They are small beside the body: those with a corner farther
/// from its middle than its diagonal do not.
TriangleMesh BladeCuts::near_body(const TriangleMesh& swept) const {
    TriangleMesh near;
    const auto is_near = [&](std::int32_t n) { return (swept.nodes[n] - centre_).norm() < size_; };
    for (const Triangle& t : swept.triangles) {
        if (!std::ranges::all_of(t, is_near)) continue;
        const auto first = static_cast<std::int32_t>(near.nodes.size());
        for (const std::int32_t n : t) near.nodes.push_back(swept.nodes[n]);
        near.triangles.push_back({first, first + 1, first + 2});
    }
    return near;
}

/// Refers to `mesh` and `displacement`.
BladeSweep::RestPlace BladeCuts::rest_place(const TetMesh& mesh,
                                            std::span<const Vector3> displacement) const {
    return [this, &mesh, displacement](const Vector3& y) {
        return cuttable_->rest_place(y, mesh, displacement);
    };
}

void BladeCuts::follow(double time_s, std::span<const std::optional<BladeEdge>> edges,
                       const TetMesh& mesh, std::span<const Vector3> displacement) {
    if (sweeps_.size() != edges.size()) sweeps_.assign(edges.size(), BladeSweep(sweep_options_));
    const BladeSweep::RestPlace at_rest = rest_place(mesh, displacement);
    for (std::size_t i = 0; i < edges.size(); ++i) {
        if (edges[i] && !is_near(*edges[i], displacement)) {
            sweeps_[i].restart();
            continue;
        }
        TriangleMesh swept = near_body(sweeps_[i].follow(time_s, edges[i], at_rest));
        count_gap(sweeps_[i]);
        take_now_or_later(time_s, std::move(swept));
    }
}

bool BladeCuts::cut_along(double time_s, std::span<const BladeEdge> line, const TetMesh& mesh,
                          std::span<const Vector3> displacement) {
    bool parts = false;
    BladeSweep sweep(sweep_options_);
    const BladeSweep::RestPlace at_rest = rest_place(mesh, displacement);
    for (std::size_t k = 0; k < line.size(); ++k) {
        const BladeEdge &from = line[k > 0 ? k - 1 : 0], &to = line[k];
        const double way = std::max((to[0] - from[0]).norm(), (to[1] - from[1]).norm());
        const int steps = std::max(1, static_cast<int>(2 * way / sweep_options_.longest_step));
        for (int step = 1; step <= steps; ++step) {
            const double s = static_cast<double>(step) / steps;
            const BladeEdge edge{from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1])};
            TriangleMesh swept = near_body(sweep.follow(time_s, edge, at_rest));
            count_gap(sweep);
            parts |= take_now_or_later(time_s, std::move(swept));
        }
    }
    return parts;
}

/// While an opening is prepared, what is cut waits for the next. Returns whether it parts cells; if
/// it waits, whether it may.
bool BladeCuts::take_now_or_later(double time_s, TriangleMesh swept) {
    if (!begun_s_) return take(time_s, swept);
    if (swept.triangles.empty()) return false;
    waiting_.emplace_back(time_s, std::move(swept));
    return true;
}

/// Length in the body of the straight way across a gap, m: the most of any point of the blade, each
/// sampled at places half a cell apart. One row may have more points than the other.
double BladeCuts::length_inside(const BladeGap& gap) const {
    const int steps =
        std::clamp(static_cast<int>(std::ceil(2 * gap.length / cuttable_->cell_edge())), 8, 200);
    const std::size_t count = std::max(gap.before.size(), gap.after.size());
    const auto point = [&](const std::vector<Vector3>& row, std::size_t i) {
        return row[i * (row.size() - 1) / std::max<std::size_t>(count - 1, 1)];
    };
    int most = 0;
    for (std::size_t i = 0; i < count && most <= steps; ++i) {
        const Vector3 from = point(gap.before, i), to = point(gap.after, i);
        int inside = 0;
        for (int step = 0; step <= steps && inside + steps + 1 - step > most; ++step) {
            const Vector3 place = from + static_cast<double>(step) / steps * (to - from);
            // What lies outside of the box's sphere need not be looked up.
            inside += (place - centre_).norm() <= 0.51 * size_ && cuttable_->holds(place);
        }
        most = std::max(most, inside);
    }
    return most * gap.length / (steps + 1);
}

/// Counts a gap in which the body may have been cut.
void BladeCuts::count_gap(const BladeSweep& sweep) {
    const auto& gap = sweep.gap();
    if (!gap || gap->length < cuttable_->cell_edge()) return;
    const double length = length_inside(*gap);
    if (length < cuttable_->cell_edge()) return;
    ++gaps_.count;
    gaps_.length += length;
}

bool BladeCuts::take(double time_s, const TriangleMesh& swept) {
    if (cuttable_->cut(swept) == 0) return false;
    if (!pending_s_) pending_s_ = time_s;
    return true;
}

bool BladeCuts::is_due(double time_s) const {
    return !begun_s_ && pending_s_ && time_s - *pending_s_ >= interval_s_ / 2;
}

/// Crumbs are left here, not when it is prepared: a clock says when that is.
double BladeCuts::begin() {
    cuttable_->rejoin_crumbs();
    begun_s_ = std::exchange(pending_s_, std::nullopt);
    return *begun_s_ + interval_s_;
}

/// What waited is cut now.
void BladeCuts::end() {
    begun_s_.reset();
    for (const auto& [time_s, swept] : std::exchange(waiting_, {})) take(time_s, swept);
}

void BladeCuts::keep() {
    cuttable_->keep();
    end();
}

void BladeCuts::undo() {
    cuttable_->undo();
    end();
}

void BladeCuts::restart() {
    pending_s_ = begun_s_;
    end();
}

}  // namespace livetet
