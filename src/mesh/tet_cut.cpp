#include "mesh/tet_cut.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/disjoint_sets.hpp"
#include "base/sort_and_unique.hpp"
#include "mesh/edge_bisection.hpp"
#include "mesh/least_dihedral.hpp"
#include "mesh/mesh_edges.hpp"
#include "mesh/node_copies.hpp"
#include "mesh/tet_faces.hpp"

namespace livetet {

namespace {

/// A node moves onto the surface where that crosses an edge within this share of its length; other
/// edges are split at least as far from their ends.
constexpr double snapped_share = 0.3;
/// Moves leave no smaller angle, rad, but where one was smaller already.
constexpr double least_angle = 15 * std::numbers::pi / 180;
/// How far, by its length, a move along the boundary may lead off a triangle of it.
constexpr double boundary_slope = 0.15;

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
        : mesh_(mesh), parted_(parted), on_surface_(mesh.nodes.size(), 0) {
        stars_ = make_lists(mesh.nodes.size(), [&](auto&& add) {
            for (std::size_t e = 0; e < mesh.tets.size(); ++e)
                for (const std::int32_t n : mesh.tets[e]) add(n, static_cast<std::int32_t>(e));
        });
        boundary_ = boundary_triangles(mesh.tets);
        at_boundary_ = make_lists(mesh.nodes.size(), [&](auto&& add) {
            for (std::size_t i = 0; i < boundary_.size(); ++i)
                for (const std::int32_t n : boundary_[i]) add(n, static_cast<std::int32_t>(i));
        });
    }

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
            on_surface_[node] = 1;
            move(node, other);
        }
        return std::move(on_surface_);
    }

  private:
    /// Whether a tet has its other corners on the surface already.
    bool would_flatten_tet(std::int32_t node) const {
        return std::ranges::any_of(stars_[node], [&](std::int32_t e) {
            return std::ranges::all_of(mesh_.tets[e],
                                       [&](std::int32_t n) { return n == node || on_surface_[n]; });
        });
    }

    bool is_on_boundary(std::int32_t node) const { return !at_boundary_[node].empty(); }

    /// Whether the boundary keeps its place as one of its nodes moves.
    bool keeps_boundary(std::int32_t node, const Vector3& way) const {
        return std::ranges::all_of(at_boundary_[node], [&](std::int32_t i) {
            const auto& [a, b, c] = boundary_[i];
            const Vector3& x = mesh_.nodes[a];
            const Vector3 normal = (mesh_.nodes[b] - x).cross(mesh_.nodes[c] - x).normalized();
            return std::abs(normal.dot(way)) <= boundary_slope * way.norm();
        });
    }

    double least_angle_around(std::int32_t node) const {
        double least = std::numbers::pi;
        for (const std::int32_t e : stars_[node])
            least = std::min(least, least_dihedral(mesh_.nodes, mesh_.tets[e]));
        return least;
    }

    /// The way to the nearest crossing of an edge of parted tets at a node; along the boundary, if
    /// the node is on it.
    Vector3 way_to_surface(std::int32_t node, std::int32_t nearest) const {
        const auto way_along = [&](std::int32_t other) {
            const EdgeNode& c = parted_.crossings[parted_.find(node, other)];
            const double share = c.a == node ? c.share : 1 - c.share;
            return Vector3(share * (mesh_.nodes[other] - mesh_.nodes[node]));
        };
        if (!is_on_boundary(node)) return way_along(nearest);
        Vector3 way = Vector3::Zero();
        for (const std::int32_t i : at_boundary_[node])
            for (const std::int32_t other : boundary_[i]) {
                if (other == node || on_surface_[other] || parted_.find(node, other) < 0) continue;
                const Vector3 along = way_along(other);
                if (keeps_boundary(node, along) && (way.isZero() || along.norm() < way.norm()))
                    way = along;
            }
        return way;
    }

    /// As far as the angles around it allow; a node that cannot move counts as on the surface where
    /// it is.
    void move(std::int32_t node, std::int32_t nearest) {
        const Vector3 way = way_to_surface(node, nearest), from = mesh_.nodes[node];
        const double enough = std::min(least_angle, least_angle_around(node));
        for (const double part : {1.0, 0.75, 0.5, 0.25}) {
            mesh_.nodes[node] = from + part * way;
            if (least_angle_around(node) >= enough) return;
        }
        mesh_.nodes[node] = from;
    }

    TetMesh& mesh_;
    const PartedEdges& parted_;
    std::vector<std::uint8_t> on_surface_;
    Lists stars_;
    std::vector<Triangle> boundary_;
    Lists at_boundary_;  ///< the boundary's triangles at each node
};

/// A side of a face whose nodes are all on the surface.
struct CutFace {
    Triangle nodes;  ///< sorted
    std::int32_t tet = 0;
    int opposite = 0;  ///< corner of that tet
    auto operator<=>(const CutFace&) const = default;
};

/// The nodes of the face opposite a corner, rising.
Triangle sorted_face(const Tet& t, int opposite) {
    const auto& [a, b, c] = tet_faces[opposite];
    Triangle face{t[a], t[b], t[c]};
    std::ranges::sort(face);
    return face;
}

/// The sides of the faces that open, of tets with corners in `on_surface`.
std::vector<CutFace> open_faces(const TetMesh& mesh, const std::vector<std::uint8_t>& on_surface,
                                const SegmentCrossings& crossings) {
    std::vector<CutFace> faces;
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        const Tet& t = mesh.tets[e];
        for (int k = 0; k < 4; ++k) {
            const Triangle face = sorted_face(t, k);
            if (on_surface[t[k]] ||
                !std::ranges::all_of(face, [&](std::int32_t n) { return on_surface[n] != 0; }))
                continue;
            faces.push_back({face, static_cast<std::int32_t>(e), k});
        }
    }
    std::ranges::sort(faces);
    std::vector<CutFace> open;
    for (std::size_t i = 1; i < faces.size(); ++i) {
        const CutFace &one = faces[i - 1], &other = faces[i];
        if (one.nodes != other.nodes) continue;
        const auto& [a, b, c] = one.nodes;
        const Vector3 middle = (mesh.nodes[a] + mesh.nodes[b] + mesh.nodes[c]) / 3;
        const SegmentCrossing here =
            crossings.between(mesh.nodes[mesh.tets[one.tet][one.opposite]], middle);
        const SegmentCrossing there =
            crossings.between(middle, mesh.nodes[mesh.tets[other.tet][other.opposite]]);
        if (here.parts() != there.parts()) open.insert(open.end(), {one, other});
    }
    return open;
}

/// Step 3: doubles the nodes that open faces part. Returns their number.
std::size_t open_cut(TetMesh& mesh, const std::vector<CutFace>& open) {
    std::vector<std::int32_t> nodes;
    for (const CutFace& face : open)
        nodes.insert(nodes.end(), face.nodes.begin(), face.nodes.end());
    sort_and_unique(nodes);
    const auto is_touched = [&](std::int32_t n) { return std::ranges::binary_search(nodes, n); };
    std::vector<std::int32_t> tets;
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        if (std::ranges::any_of(mesh.tets[e], is_touched))
            tets.push_back(static_cast<std::int32_t>(e));
    // Corners of neighbouring tets are joined across faces that stay closed.
    std::vector<CutFace> faces;
    for (std::size_t i = 0; i < tets.size(); ++i)
        for (int k = 0; k < 4; ++k) {
            const Tet& t = mesh.tets[tets[i]];
            const Triangle face = sorted_face(t, k);
            if (std::ranges::none_of(face, is_touched)) continue;
            faces.push_back({face, static_cast<std::int32_t>(i), k});
        }
    std::ranges::sort(faces);
    DisjointSets corners(4 * tets.size());
    const auto corner = [&](std::int32_t i, std::int32_t node) {
        const Tet& t = mesh.tets[tets[i]];
        return 4 * i + static_cast<std::int32_t>(std::ranges::find(t, node) - t.begin());
    };
    for (std::size_t f = 1; f < faces.size(); ++f) {
        const CutFace &one = faces[f - 1], &other = faces[f];
        if (one.nodes != other.nodes ||
            std::ranges::binary_search(open, one.nodes, {}, &CutFace::nodes))
            continue;
        for (const std::int32_t n : one.nodes)
            if (is_touched(n)) corners.join(corner(one.tet, n), corner(other.tet, n));
    }
    NodeCopies copies(mesh.nodes.size(), 4 * tets.size());
    const TetMesh before = mesh.triangle_sets.empty() ? TetMesh{} : mesh;
    for (std::size_t i = 0; i < tets.size(); ++i)
        for (int c = 0; c < 4; ++c) {
            std::int32_t& n = mesh.tets[tets[i]][c];
            if (is_touched(n))
                n = copies.number(n, corners.find(static_cast<std::int32_t>(4 * i + c)));
        }
    const std::vector<std::int32_t> originals = copies.take_originals();
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
    cut.counts.doubled = open_cut(made, open_faces(made, on_surface, crossings));
    return cut;
}

}  // namespace livetet
