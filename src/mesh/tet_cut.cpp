#include "mesh/tet_cut.hpp"

#include <algorithm>
#include <array>
#include <map>

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
    std::vector<std::uint8_t> groups;   ///< of each tet: group_of_first, 0 where it is not parted

    /// Its place in the lists; -1: no tet is parted there.
    std::int32_t find(std::int32_t a, std::int32_t b) const {
        const auto at = std::ranges::lower_bound(numbers, edge_between(edges, a, b));
        if (at == numbers.end() || *at != edge_between(edges, a, b)) return -1;
        return static_cast<std::int32_t>(at - numbers.begin());
    }
};

std::array<std::int32_t, 6> edges_of(const Lists& edges, const Tet& t) {
    std::array<std::int32_t, 6> numbers{};
    for (int k = 0; k < 6; ++k)
        numbers[k] = edge_between(edges, t[tet_edges[k][0]], t[tet_edges[k][1]]);
    return numbers;
}

int group_by_edges(const std::array<std::int32_t, 6>& numbers, const std::vector<double>& shares) {
    std::array<bool, 6> is_crossed{};
    for (int k = 0; k < 6; ++k) is_crossed[k] = shares[numbers[k]] >= 0;
    return group_of_first(is_crossed);
}

/// Finds where tets would be crossed that a surface ends in, if it went on as a plane. It counts as
/// going on in a tet if the middle of the tet's section by that plane is on the surface: so what is
/// parted ends, on average, where the surface does.
class SurfaceEnds {
  public:
    SurfaceEnds(const TetMesh& mesh, const Lists& edges, const SegmentCrossings& crossings)
        : mesh_(mesh), edges_(edges), crossings_(crossings) {}

    /// `shares`: of each edge the share at which it is crossed; below 0: it is not.
    void go_on(std::vector<double>& shares) const {
        const std::vector<double> before = shares;
        // The edges of tets that the surface itself parts stay as they are.
        std::vector<std::uint8_t> is_settled(shares.size(), 0);
        for (const Tet& t : mesh_.tets) {
            const auto numbers = edges_of(edges_, t);
            if (group_by_edges(numbers, before) == 0) continue;
            for (const std::int32_t n : numbers) is_settled[n] = 1;
        }
        for (const Tet& t : mesh_.tets) {
            const auto numbers = edges_of(edges_, t);
            const auto is_crossed = [&](std::int32_t n) { return before[n] >= 0; };
            if (std::ranges::any_of(numbers, is_crossed) && group_by_edges(numbers, before) == 0)
                go_on_in(t, numbers, before, is_settled, shares);
        }
    }

  private:
    void go_on_in(const Tet& t, const std::array<std::int32_t, 6>& numbers,
                  const std::vector<double>& before, const std::vector<std::uint8_t>& is_settled,
                  std::vector<double>& shares) const {
        Vector3 point = Vector3::Zero(), normal = Vector3::Zero();
        int crossed = 0;
        for (int k = 0; k < 6; ++k) {
            if (before[numbers[k]] < 0) continue;
            const auto [a, b] = std::minmax(t[tet_edges[k][0]], t[tet_edges[k][1]]);
            const Vector3 &from = mesh_.nodes[a], &to = mesh_.nodes[b];
            point += from + before[numbers[k]] * (to - from);
            normal = crossings_.between(from, to).normal;
            ++crossed;
        }
        point /= crossed;
        Vector3 middle = Vector3::Zero();
        double count = 0, length = 0;
        std::array<double, 6> found{};
        for (int k = 0; k < 6; ++k) {
            const auto [a, b] = std::minmax(t[tet_edges[k][0]], t[tet_edges[k][1]]);
            const Vector3 &from = mesh_.nodes[a], &to = mesh_.nodes[b];
            const double below = (from - point).dot(normal), above = (to - point).dot(normal);
            length += (to - from).norm() / 6;
            found[k] = (below >= 0) != (above >= 0) ? below / (below - above) : -1;
            if (found[k] < 0) continue;
            middle += from + found[k] * (to - from);
            ++count;
        }
        if (count == 0) return;
        middle /= count;
        const Vector3 aside = length / 4 * normal;
        if (!crossings_.between(middle - aside, middle + aside).parts()) return;
        for (int k = 0; k < 6; ++k)
            if (found[k] >= 0 && before[numbers[k]] < 0 && !is_settled[numbers[k]])
                shares[numbers[k]] = found[k];
    }

    const TetMesh& mesh_;
    const Lists& edges_;
    const SegmentCrossings& crossings_;
};

PartedEdges parted_edges(const TetMesh& mesh, const SegmentCrossings& crossings) {
    PartedEdges parted;
    parted.edges = edges_by_lower_end(mesh.tets, mesh.nodes.size());
    const Lists& edges = parted.edges;
    std::vector<double> shares(edges.items.size(), -1);
    for (std::size_t a = 0; a < mesh.nodes.size(); ++a)
        for (std::int32_t i = edges.start[a]; i < edges.start[a + 1]; ++i) {
            const SegmentCrossing crossing =
                crossings.between(mesh.nodes[a], mesh.nodes[edges.items[i]]);
            if (crossing.parts()) shares[i] = crossing.first;
        }
    SurfaceEnds(mesh, edges, crossings).go_on(shares);
    std::vector<std::uint8_t> is_parted(edges.items.size(), 0);
    for (const Tet& t : mesh.tets) {
        const auto numbers = edges_of(edges, t);
        const int first = group_by_edges(numbers, shares);
        parted.groups.push_back(static_cast<std::uint8_t>(first));
        if (first == 0) continue;
        for (int k = 0; k < 6; ++k)
            if ((first >> tet_edges[k][0] & 1) != (first >> tet_edges[k][1] & 1))
                is_parted[numbers[k]] = 1;
    }
    for (std::size_t a = 0; a < mesh.nodes.size(); ++a)
        for (std::int32_t i = edges.start[a]; i < edges.start[a + 1]; ++i) {
            if (!is_parted[i]) continue;
            parted.numbers.push_back(i);
            parted.crossings.push_back({static_cast<std::int32_t>(a), edges.items[i], shares[i]});
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

/// Which faces open, step 3, decided by the groups of corners of the tets before their edges were
/// split: places may have moved past the surface a little.
class OpenFaces {
  public:
    /// `parents`: of each tet now, among those of `before`.
    OpenFaces(const std::vector<Tet>& before, const PartedEdges& parted,
              const std::vector<std::int32_t>& parents, const std::vector<std::uint8_t>& on_surface)
        : before_(before), parted_(parted), parents_(parents), on_surface_(on_surface) {}

    /// Whether all nodes of the face between two tets are on the surface, which is between them.
    bool is_open(const std::vector<Tet>& tets, const TetLink& link) const {
        const Tet &one = tets[link.lower], &other = tets[link.upper];
        const std::int32_t near = opposite(one, other), far = opposite(other, one);
        if (on_surface_[near] || on_surface_[far]) return false;
        for (const std::int32_t n : one)
            if (n != near && !on_surface_[n]) return false;
        const std::int32_t p = parents_[link.lower], q = parents_[link.upper];
        if (p == q) return !are_together(p, near, far);
        for (const std::int32_t n : one)  // a corner of both
            if (n != near && is_corner(p, n) && is_corner(q, n))
                return are_together(p, near, n) != are_together(q, far, n);
        return false;
    }

  private:
    bool is_corner(std::int32_t tet, std::int32_t n) const {
        return std::ranges::find(before_[tet], n) != before_[tet].end();
    }
    /// Whether the surface does not part two corners of a tet.
    bool are_together(std::int32_t tet, std::int32_t a, std::int32_t b) const {
        const auto bit = [&](std::int32_t n) {
            const Tet& t = before_[tet];
            return parted_.groups[tet] >> (std::ranges::find(t, n) - t.begin()) & 1;
        };
        return bit(a) == bit(b);
    }

    const std::vector<Tet>& before_;
    const PartedEdges& parted_;
    const std::vector<std::int32_t>& parents_;
    const std::vector<std::uint8_t>& on_surface_;
};

/// Step 4: moves the nodes of open faces that are not `doubled` onto the surface's border.
void move_front(TetMesh& mesh, std::span<const TetLink> links, std::span<const std::uint8_t> is_cut,
                std::span<const std::int32_t> doubled, const SurfaceBorder& border) {
    std::map<std::int32_t, double> front;  // by node: the longest edge of open faces there
    for (std::size_t l = 0; l < links.size(); ++l) {
        if (!is_cut[l]) continue;
        const Tet &one = mesh.tets[links[l].lower], &other = mesh.tets[links[l].upper];
        const std::int32_t near = opposite(one, other);
        for (const std::int32_t n : one)
            for (const std::int32_t m : one)
                if (n != near && m != near)
                    front[n] = std::max(front[n], (mesh.nodes[n] - mesh.nodes[m]).norm());
    }
    for (const std::int32_t n : doubled) front.erase(n);
    MovableNodes movable(mesh);
    for (const auto& [node, edge] : front) {
        const auto end = nearest_on(border, mesh.nodes[node], edge);
        if (end && movable.keeps_boundary(node, *end - mesh.nodes[node]))
            movable.move(node, *end - mesh.nodes[node]);
    }
}

/// Step 3: doubles the nodes that open faces part. Returns their number.
std::size_t open_cut(TetMesh& mesh, const OpenFaces& faces, const SegmentCrossings& crossings) {
    const std::vector<TetLink> links = links_of(mesh.tets);
    std::vector<std::uint8_t> is_cut;
    for (const TetLink& link : links) is_cut.push_back(faces.is_open(mesh.tets, link));
    std::vector<Tet> parted = mesh.tets;
    const auto originals = part_nodes(parted, mesh.nodes.size(), links, is_cut);
    move_front(mesh, links, is_cut, originals, crossings.border());  // while faces hang together
    mesh.triangle_sets = moved_sets(mesh, parted);
    mesh.tets = std::move(parted);
    append_copies(mesh, originals);
    return originals.size();
}

}  // namespace

CutTets cut_tets(TetMesh mesh, const SegmentCrossings& crossings) {
    CutTets cut;
    const PartedEdges parted = parted_edges(mesh, crossings);
    cut.counts.parted = static_cast<std::size_t>(
        std::ranges::count_if(parted.groups, [](std::uint8_t group) { return group != 0; }));
    TetMesh& made = cut.mesh = std::move(mesh);
    if (cut.counts.parted == 0) return cut;
    const std::vector<Tet> before = made.tets;
    std::vector<std::uint8_t> on_surface = NodeSnapping(made, parted).run();
    std::vector<EdgeNode> splits;
    for (const auto& [a, b, share] : parted.crossings)
        if (!on_surface[a] && !on_surface[b])
            splits.push_back({a, b, std::clamp(share, snapped_share, 1 - snapped_share)});
    const std::vector<std::int32_t> parents = bisect_edges(made, splits);
    cut.counts.added = splits.size();
    on_surface.resize(made.nodes.size(), 1);
    cut.counts.doubled = open_cut(made, OpenFaces(before, parted, parents, on_surface), crossings);
    return cut;
}

}  // namespace livetet
