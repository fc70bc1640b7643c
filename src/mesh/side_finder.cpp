#include "mesh/side_finder.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "base/sliced_task.hpp"
#include "mesh/point_locator.hpp"
#include "mesh/tet_links.hpp"

namespace livetet {

namespace {

constexpr double not_reached = std::numeric_limits<double>::infinity();

std::vector<Vector3> middles_of(const TetMesh& mesh) {
    std::vector<Vector3> middles;
    middles.reserve(mesh.tets.size());
    for (const Tet& t : mesh.tets)
        middles.push_back(
            (mesh.nodes[t[0]] + mesh.nodes[t[1]] + mesh.nodes[t[2]] + mesh.nodes[t[3]]) / 4);
    return middles;
}

/// Which nodes have others at their places.
std::vector<std::uint8_t> doubled_nodes(const TetMesh& mesh) {
    std::vector<std::int32_t> order(mesh.nodes.size());
    std::iota(order.begin(), order.end(), 0);
    const auto place = [&](std::int32_t n) {
        const Vector3& x = mesh.nodes[n];
        return std::array{x.x(), x.y(), x.z()};
    };
    std::ranges::sort(order, {}, place);
    std::vector<std::uint8_t> is_doubled(mesh.nodes.size(), 0);
    for (std::size_t i = 1; i < order.size(); ++i)
        if (place(order[i - 1]) == place(order[i]))
            is_doubled[order[i - 1]] = is_doubled[order[i]] = 1;
    return is_doubled;
}

/// The given nodes, and those that share a tet with one.
std::vector<std::uint8_t> with_neighbours(const std::vector<std::uint8_t>& nodes,
                                          std::span<const Tet> tets) {
    std::vector<std::uint8_t> wider = nodes;
    for (const Tet& t : tets)
        if (std::ranges::any_of(t, [&](std::int32_t n) { return nodes[n] != 0; }))
            for (const std::int32_t n : t) wider[n] = 1;
    return wider;
}

/// Of each tet a place on its side of gaps; see SideFinder. Where not even neighbours of neighbours
/// have a corner that is not doubled it is the middle.
std::vector<Vector3> places_off_gaps(const TetMesh& mesh,
                                     const std::vector<std::uint8_t>& is_doubled,
                                     std::span<const std::array<std::int32_t, 4>> across) {
    std::vector<Vector3> places = middles_of(mesh);
    std::vector<std::uint8_t> is_off(places.size(), 0);
    for (std::size_t t = 0; t < places.size(); ++t) {
        Vector3 sum = Vector3::Zero();
        int count = 0;
        for (const std::int32_t n : mesh.tets[t])
            if (!is_doubled[n]) sum += mesh.nodes[n], ++count;
        if (count == 0) continue;
        places[t] = (places[t] + sum / count) / 2;
        is_off[t] = 1;
    }
    for (int sweep = 0; sweep < 2; ++sweep) {
        const std::vector<std::uint8_t> was_off = is_off;
        for (std::size_t t = 0; t < places.size(); ++t) {
            if (was_off[t]) continue;
            Vector3 sum = Vector3::Zero();
            int count = 0;
            for (const std::int32_t next : across[t])
                if (next >= 0 && was_off[next]) sum += places[next], ++count;
            if (count == 0) continue;
            places[t] = sum / count;
            is_off[t] = 1;
        }
    }
    return places;
}

double longest_edge(const TetMesh& mesh, const Tet& t) {
    double longest = 0;
    for (int a = 0; a < 4; ++a)
        for (int b = 0; b < a; ++b)
            longest = std::max(longest, (mesh.nodes[t[a]] - mesh.nodes[t[b]]).norm());
    return longest;
}

}  // namespace

SideFinder::SideFinder(const TetMesh& fine, const PointLocator& in_fine, const TetMesh& coarse)
    : fine_(fine), coarse_(coarse) {
    const std::vector<std::uint8_t> is_doubled = doubled_nodes(coarse);
    knows_gaps_ = std::ranges::count(is_doubled, 1) > 0;
    if (!knows_gaps_) return;
    is_near_ = with_neighbours(is_doubled, coarse.tets);
    const auto across_coarse = tets_across(coarse.tets);
    pause_point();
    places_ = places_off_gaps(coarse, is_doubled, across_coarse);
    pause_point();
    tet_at_.assign(places_.size(), -1);
    for (std::size_t c = 0; c < places_.size(); ++c) {
        if (!is_near_gap(coarse.tets[c])) continue;
        pause_point_at(c);
        const PointLocator::Hit hit = in_fine.find(places_[c]);
        if (hit.distance < 0.1 * longest_edge(coarse, coarse.tets[c])) tet_at_[c] = hit.tet;
    }
    across_ = tets_across(fine.tets);
    pause_point();
    forget_hidden_places(across_coarse);
    pause_point();
    places_in_ = make_lists(fine.tets.size(), [&](auto&& add) {
        for (std::size_t c = 0; c < tet_at_.size(); ++c)
            if (tet_at_[c] >= 0) add(tet_at_[c], static_cast<std::int32_t>(c));
    });
    middles_ = middles_of(fine);
    pause_point();
    around_ = make_lists(fine.nodes.size(), [&](auto&& add) {
        for (std::size_t t = 0; t < fine.tets.size(); ++t)
            for (const std::int32_t n : fine.tets[t]) add(n, static_cast<std::int32_t>(t));
    });
    length_.assign(fine.tets.size(), not_reached);
}

/// Forgets places that at least half of the neighbours' places do not see: they are on the wrong
/// side, as where a corner of the body sticks through the cut.
void SideFinder::forget_hidden_places(std::span<const std::array<std::int32_t, 4>> across) {
    std::vector<std::int32_t> hidden;
    for (std::size_t c = 0; c < places_.size(); ++c) {
        if (tet_at_[c] < 0) continue;
        int seen = 0, not_seen = 0;
        for (const std::int32_t next : across[c])
            if (next >= 0 && tet_at_[next] >= 0)
                ++(sees(tet_at_[next], static_cast<std::int32_t>(c)) ? seen : not_seen);
        if (not_seen > 0 && not_seen >= seen) hidden.push_back(static_cast<std::int32_t>(c));
    }
    for (const std::int32_t c : hidden) tet_at_[c] = -1;
}

bool SideFinder::is_near_gap(const Tet& coarse_tet) const {
    return std::ranges::any_of(coarse_tet, [&](std::int32_t n) { return is_near_[n] != 0; });
}

HoldingTet SideFinder::tet_beside(std::int32_t node, std::int32_t found) {
    const auto distance = [&](std::int32_t t) {
        return (middles_[t] - places_[found]).squaredNorm();
    };
    if (!sees(*std::ranges::min_element(around_[node], {}, distance), found))
        return best_reached(node, found);
    HoldingTet same;
    same.look(coarse_, {&found, 1}, fine_.nodes[node]);
    return same;
}

/// Whether a walk from a fine tet, `at`, gets to the place of a coarse one by going, in each tet,
/// through the face that the place is farthest behind. Most do, in a few steps.
bool SideFinder::sees(std::int32_t at, std::int32_t coarse_tet) const {
    const Vector3& place = places_[coarse_tet];
    constexpr int most_steps = 200;  // rounding may lead round an edge
    for (int step = 0; step < most_steps && at >= 0; ++step) {
        if (at == tet_at_[coarse_tet]) return true;
        const auto weights = frame_of(fine_, fine_.tets[at]).weights(place);
        at = across_[at][std::ranges::min_element(weights) - weights.begin()];
    }
    return false;
}

/// Dijkstra's search over the fine tets, until `found` is reached or another tet that holds the
/// node.
HoldingTet SideFinder::best_reached(std::int32_t node, std::int32_t found) {
    pause_point();
    const Vector3& x = fine_.nodes[node];
    const double edge = longest_edge(coarse_, coarse_.tets[found]);
    double farthest = 2 * edge;
    HoldingTet best;
    for (const std::int32_t t : around_[node]) reach(t, (middles_[t] - x).norm());
    while (!front_.empty() && best.tet != found && best.least < 0) {
        const Reached at = front_.front();
        if (at.length > farthest) break;
        std::ranges::pop_heap(front_, std::greater<>{});
        front_.pop_back();
        if (at.length > length_[at.tet]) continue;  // a shorter way came later
        for (const std::int32_t& c : places_in_[at.tet]) {
            if (at.length > 2 * (places_[c] - x).norm() + edge / 2) continue;
            if (c == found) best = {};  // preferred to all others
            best.look(coarse_, {&c, 1}, x);
            if (c == found) break;
            farthest = std::min(farthest, 2 * at.length);
        }
        for (const std::int32_t next : across_[at.tet]) {
            if (next < 0) continue;
            const double length = at.length + (middles_[next] - middles_[at.tet]).norm();
            if (length <= farthest) reach(next, length);
        }
    }
    for (const std::int32_t t : known_) length_[t] = not_reached;
    known_.clear();
    front_.clear();
    return best;
}

void SideFinder::reach(std::int32_t tet, double length) {
    if (length >= length_[tet]) return;
    if (length_[tet] == not_reached) known_.push_back(tet);
    length_[tet] = length;
    front_.push_back({length, tet});
    std::ranges::push_heap(front_, std::greater<>{});
}

}  // namespace livetet
