#include "mesh/tet_cut.hpp"

#include <algorithm>
#include <array>

#include "base/disjoint_sets.hpp"
#include "mesh/edge_bisection.hpp"
#include "mesh/mesh_edges.hpp"
#include "mesh/movable_nodes.hpp"
#include "mesh/node_copies.hpp"
#include "mesh/tet_links.hpp"

namespace livetet {

namespace {

/// A node moves onto the surface where that crosses an edge within this share of its length; other
/// edges are split at least as far from their ends.
constexpr double snapped_share = 0.3;
/// The groups of a tet's corners that edges which are not crossed hold together: the bits of that
/// of corner 0, or 0 unless there are two.
int group_of_first(const std::array<bool, 6>& is_crossed) {
    DisjointSets groups(4);
    for (int k = 0; k < 6; ++k)
        if (!is_crossed[k]) groups.join(tet_edges[k][0], tet_edges[k][1]);
    int first = 0;
    std::int32_t other = -1;
    for (int c = 0; c < 4; ++c) {
        const std::int32_t group = groups.find(c);
        if (group == 0)
            first |= 1 << c;
        else if (other >= 0 && group != other)
            return 0;
        else
            other = group;
    }
    return other < 0 ? 0 : first;
}

/// The edges at which a surface parts tets.
struct PartedEdges {
    Lists edges;                        ///< of the mesh, by their lower ends
    std::vector<std::int32_t> numbers;  ///< of those at which tets are parted, rising
    std::vector<EdgeNode> crossings;    ///< of each of them, a < b
    std::size_t tets = 0;               ///< that are parted

    /// Its place in the lists; -1: no tet is parted there.
    std::int32_t find(std::int32_t a, std::int32_t b) const {
        const auto at = std::ranges::lower_bound(numbers, edge_between(edges, a, b));
        if (at == numbers.end() || *at != edge_between(edges, a, b)) return -1;
        return static_cast<std::int32_t>(at - numbers.begin());
    }
};

PartedEdges parted_edges(const TetMesh& mesh, const SegmentCrossings& crossings) {
    PartedEdges parted;
    parted.edges = edges_by_lower_end(mesh.tets, mesh.nodes.size());
    const Lists& edges = parted.edges;
    std::vector<double> share(edges.items.size(), -1);  // -1: not crossed
    for (std::size_t a = 0; a < mesh.nodes.size(); ++a)
        for (std::int32_t i = edges.start[a]; i < edges.start[a + 1]; ++i) {
            const SegmentCrossing crossing =
                crossings.between(mesh.nodes[a], mesh.nodes[edges.items[i]]);
            if (crossing.parts()) share[i] = crossing.first;
        }
    std::vector<std::uint8_t> is_parted(edges.items.size(), 0);
    for (const Tet& t : mesh.tets) {
        std::array<std::int32_t, 6> numbers{};
        std::array<bool, 6> is_crossed{};
        for (int k = 0; k < 6; ++k) {
            numbers[k] = edge_between(edges, t[tet_edges[k][0]], t[tet_edges[k][1]]);
            is_crossed[k] = share[numbers[k]] >= 0;
        }
        const int first = group_of_first(is_crossed);
        if (first == 0) continue;
        ++parted.tets;
        for (int k = 0; k < 6; ++k)
            if ((first >> tet_edges[k][0] & 1) != (first >> tet_edges[k][1] & 1))
                is_parted[numbers[k]] = 1;
    }
    for (std::size_t a = 0; a < mesh.nodes.size(); ++a)
        for (std::int32_t i = edges.start[a]; i < edges.start[a + 1]; ++i) {
            if (!is_parted[i]) continue;
            parted.numbers.push_back(i);
            parted.crossings.push_back({static_cast<std::int32_t>(a), edges.items[i], share[i]});
        }
    return parted;
}

/// Moves nodes onto the surface, step 1.
class NodeSnapping {
  public:
    NodeSnapping(TetMesh& mesh, const PartedEdges& parted)
        : mesh_(mesh), parted_(parted), on_surface_(mesh.nodes.size(), 0), movable_(mesh) {}

    /// For each node whether it is on the surface now. Nearest crossings come first.
    std::vector<std::uint8_t> run() {
        struct Near {
            double share;
            std::int32_t node, other;
        };
        std::vector<Near> near;
        for (const auto& [a, b, share] : parted_.crossings) {
            if (share < snapped_share) near.push_back({share, a, b});
            if (1 - share < snapped_share) near.push_back({1 - share, b, a});
        }
        std::ranges::stable_sort(near, {}, &Near::share);
        for (const auto& [share, node, other] : near) {
            if (on_surface_[node] || on_surface_[other] || would_flatten_tet(node)) continue;
            on_surface_[node] = 1;  // where it is, if it cannot move
            movable_.move(node, way_to_surface(node, other));
        }
        return std::move(on_surface_);
    }

  private:
    /// Whether a tet has its other corners on the surface already.
    bool would_flatten_tet(std::int32_t node) const {
        return std::ranges::any_of(movable_.tets_at(node), [&](std::int32_t e) {
            return std::ranges::all_of(mesh_.tets[e],
                                       [&](std::int32_t n) { return n == node || on_surface_[n]; });
        });
    }

    /// The way to the nearest crossing of an edge of parted tets at a node; along the boundary, if
    /// the node is on it.
    Vector3 way_to_surface(std::int32_t node, std::int32_t nearest) const {
        const auto way_along = [&](std::int32_t other) {
            const EdgeNode& c = parted_.crossings[parted_.find(node, other)];
            const double share = c.a == node ? c.share : 1 - c.share;
            return Vector3(share * (mesh_.nodes[other] - mesh_.nodes[node]));
        };
        if (movable_.boundary_at(node).empty()) return way_along(nearest);
        Vector3 way = Vector3::Zero();
        for (const std::int32_t i : movable_.boundary_at(node))
            for (const std::int32_t other : movable_.triangle(i)) {
                if (other == node || on_surface_[other] || parted_.find(node, other) < 0) continue;
                const Vector3 along = way_along(other);
                if (movable_.keeps_boundary(node, along) &&
                    (way.isZero() || along.norm() < way.norm()))
                    way = along;
            }
        return way;
    }

    TetMesh& mesh_;
    const PartedEdges& parted_;
    std::vector<std::uint8_t> on_surface_;
    MovableNodes movable_;
};

/// The corner of a tet that is not in a face with another one.
std::int32_t opposite(const Tet& t, const Tet& other) {
    return *std::ranges::find_if(
        t, [&](std::int32_t n) { return std::ranges::find(other, n) == other.end(); });
}

/// Whether all nodes of the face between two tets are on the surface, and the tets on both sides.
bool is_open(const TetMesh& mesh, const TetLink& link, const std::vector<std::uint8_t>& on_surface,
             const SegmentCrossings& crossings) {
    const Tet &one = mesh.tets[link.lower], &other = mesh.tets[link.upper];
    const std::int32_t near = opposite(one, other), far = opposite(other, one);
    Vector3 middle = Vector3::Zero();
    for (const std::int32_t n : one) {
        if (n == near) continue;
        if (!on_surface[n]) return false;
        middle += mesh.nodes[n] / 3;
    }
    return !on_surface[near] && !on_surface[far] &&
           crossings.between(mesh.nodes[near], middle).parts() !=
               crossings.between(middle, mesh.nodes[far]).parts();
}

/// Step 3: doubles the nodes that open faces part. Returns their number.
std::size_t open_cut(TetMesh& mesh, const std::vector<std::uint8_t>& on_surface,
                     const SegmentCrossings& crossings) {
    const std::vector<TetLink> links = links_of(mesh.tets);
    std::vector<std::uint8_t> is_cut;
    for (const TetLink& link : links) is_cut.push_back(is_open(mesh, link, on_surface, crossings));
    const TetMesh before = mesh.triangle_sets.empty() ? TetMesh{} : mesh;
    const auto originals = part_nodes(mesh.tets, mesh.nodes.size(), links, is_cut);
    append_copies(mesh, originals);
    if (!before.triangle_sets.empty()) mesh.triangle_sets = moved_sets(before, mesh.tets);
    return originals.size();
}

}  // namespace

CutTets cut_tets(TetMesh mesh, const SegmentCrossings& crossings) {
    CutTets cut;
    const PartedEdges parted = parted_edges(mesh, crossings);
    cut.counts.parted = parted.tets;
    TetMesh& made = cut.mesh = std::move(mesh);
    if (parted.tets == 0) return cut;
    std::vector<std::uint8_t> on_surface = NodeSnapping(made, parted).run();
    std::vector<EdgeNode> splits;
    for (const auto& [a, b, share] : parted.crossings)
        if (!on_surface[a] && !on_surface[b])
            splits.push_back({a, b, std::clamp(share, snapped_share, 1 - snapped_share)});
    bisect_edges(made, splits);
    cut.counts.added = splits.size();
    on_surface.resize(made.nodes.size(), 1);
    cut.counts.doubled = open_cut(made, on_surface, crossings);
    return cut;
}

}  // namespace livetet
