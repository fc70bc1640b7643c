#include "mesh/edge_bisection.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/sort_and_unique.hpp"
#include "mesh/mesh_edges.hpp"

namespace livetet {

namespace {

/// The tets around the ends of edges that are split, and around the new nodes.
class Stars {
  public:
    Stars(const TetMesh& mesh, std::span<const EdgeNode> splits) {
        for (const EdgeNode& split : splits) stars_[split.a], stars_[split.b];
        for (std::size_t e = 0; e < mesh.tets.size(); ++e)
            for (const std::int32_t n : mesh.tets[e]) add(n, static_cast<std::int32_t>(e));
    }

    void follow(std::int32_t node) { stars_[node]; }
    void add(std::int32_t node, std::int32_t tet) {
        if (const auto star = stars_.find(node); star != stars_.end()) star->second.push_back(tet);
    }
    void remove(std::int32_t node, std::int32_t tet) { std::erase(stars_.at(node), tet); }
    /// The tets that have both nodes, rising.
    std::vector<std::int32_t> around(const std::vector<Tet>& tets, std::int32_t a,
                                     std::int32_t b) const {
        std::vector<std::int32_t> found;
        for (const std::int32_t e : stars_.at(a))
            if (std::ranges::find(tets[e], b) != tets[e].end()) found.push_back(e);
        std::ranges::sort(found);
        return found;
    }

  private:
    std::unordered_map<std::int32_t, std::vector<std::int32_t>> stars_;
};

void split_tets(TetMesh& mesh, std::vector<std::int32_t>& parents, Stars& stars,
                const EdgeNode& split, std::int32_t middle) {
    stars.follow(middle);
    const auto [low, high] = std::minmax(split.a, split.b);
    for (const std::int32_t e : stars.around(mesh.tets, low, high)) {
        const auto added = static_cast<std::int32_t>(mesh.tets.size());
        Tet other = mesh.tets[e];
        std::ranges::replace(other, low, middle);
        std::ranges::replace(mesh.tets[e], high, middle);
        mesh.tets.push_back(other);
        parents.push_back(std::int32_t{parents[e]});
        if (!mesh.regions.empty()) mesh.regions.push_back(std::int32_t{mesh.regions[e]});
        stars.remove(high, e);
        stars.add(middle, e);
        for (const std::int32_t n : other) stars.add(n, added);
    }
}

/// By edge: the place of its split in the list.
using SplitOfEdge = std::unordered_map<std::uint64_t, std::int32_t>;

/// Appends what a triangle is split into. The first of its edges in the list comes first, as it
/// does in tets.
void append_parts(const Triangle& t, const SplitOfEdge& splits, std::int32_t first_node,
                  std::vector<Triangle>& parts) {
    std::int32_t earliest = -1;
    int corner = 0;  // of which the edge to the next one is split
    for (int k = 0; k < 3; ++k) {
        const auto split = splits.find(edge_key(t[k], t[(k + 1) % 3]));
        if (split == splits.end() || (earliest >= 0 && split->second > earliest)) continue;
        earliest = split->second;
        corner = k;
    }
    if (earliest < 0) return parts.push_back(t);
    Triangle one = t, other = t;
    one[(corner + 1) % 3] = other[corner] = first_node + earliest;
    append_parts(one, splits, first_node, parts);
    append_parts(other, splits, first_node, parts);
}

void split_sets(TetMesh& mesh, std::span<const EdgeNode> splits, std::int32_t first_node) {
    if (!mesh.triangle_sets.empty()) {
        SplitOfEdge split_of;
        for (std::size_t i = 0; i < splits.size(); ++i)
            split_of.emplace(edge_key(splits[i].a, splits[i].b), static_cast<std::int32_t>(i));
        for (auto& [name, triangles] : mesh.triangle_sets) {
            std::vector<Triangle> parts;
            for (const Triangle& t : triangles) append_parts(t, split_of, first_node, parts);
            triangles = std::move(parts);
        }
    }
    if (mesh.node_sets.empty()) return;
    const std::vector<Triangle> boundary = boundary_triangles(mesh.tets);
    std::vector<std::uint8_t> on_boundary(static_cast<std::size_t>(first_node), 0);
    std::vector<std::uint64_t> edges;
    for (const Triangle& t : boundary)
        for (int k = 0; k < 3; ++k) {
            on_boundary[t[k]] = 1;
            edges.push_back(edge_key(t[k], t[(k + 1) % 3]));
        }
    sort_and_unique(edges);
    for (auto& [name, nodes] : mesh.node_sets) {
        std::vector<std::uint8_t> is_in(static_cast<std::size_t>(first_node), 0);
        for (const std::int32_t n : nodes) is_in[n] = 1;
        for (std::size_t i = 0; i < splits.size(); ++i) {
            const auto& [a, b, share] = splits[i];
            if (!is_in[a] || !is_in[b]) continue;
            if (!on_boundary[a] || !on_boundary[b] ||
                std::ranges::binary_search(edges, edge_key(a, b)))
                nodes.push_back(first_node + static_cast<std::int32_t>(i));
        }
    }
}

}  // namespace

std::vector<std::int32_t> bisect_edges(TetMesh& mesh, std::span<const EdgeNode> splits) {
    const auto first = static_cast<std::int32_t>(mesh.nodes.size());
    split_sets(mesh, splits, first);
    std::vector<std::int32_t> parents(mesh.tets.size());
    std::iota(parents.begin(), parents.end(), 0);
    Stars stars(mesh, splits);
    for (std::size_t i = 0; i < splits.size(); ++i) {
        const auto& [a, b, share] = splits[i];
        mesh.nodes.push_back((1 - share) * mesh.nodes[a] + share * mesh.nodes[b]);
        split_tets(mesh, parents, stars, splits[i], first + static_cast<std::int32_t>(i));
    }
    return parents;
}

}  // namespace livetet
