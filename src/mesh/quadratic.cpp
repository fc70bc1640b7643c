#include "mesh/quadratic.hpp"

#include <algorithm>
#include <numeric>

#include "base/error.hpp"
#include "mesh/mesh_edges.hpp"

namespace livetet {

TetMesh quadratic_mesh(const TetMesh& linear) {
    TetMesh mesh = linear;
    const auto corners = static_cast<std::int32_t>(linear.nodes.size());
    const Lists edges = edges_by_lower_end(linear.tets, linear.nodes.size());
    const auto middle = [&](std::int32_t a, std::int32_t b) {
        const std::int32_t edge = edge_between(edges, a, b);
        if (edge < 0)
            fail("triangle sets: found an edge {}-{}, which the mesh does not have", a, b);
        return corners + edge;
    };
    mesh.nodes.reserve(linear.nodes.size() + edges.items.size());
    for (std::int32_t a = 0; a < corners; ++a)
        for (const std::int32_t b : edges[static_cast<std::size_t>(a)])
            mesh.nodes.push_back((linear.nodes[a] + linear.nodes[b]) / 2);
    mesh.edge_nodes.resize(mesh.tets.size());
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        for (int k = 0; k < 6; ++k)
            mesh.edge_nodes[e][k] =
                middle(mesh.tets[e][tet_edges[k][0]], mesh.tets[e][tet_edges[k][1]]);
    for (auto& [name, nodes] : mesh.node_sets) {
        std::vector<std::int32_t> more;
        if (const auto triangles = mesh.triangle_sets.find(name);
            triangles != mesh.triangle_sets.end()) {
            for (const Triangle& t : triangles->second)
                for (int k = 0; k < 3; ++k) more.push_back(middle(t[k], t[(k + 1) % 3]));
        } else {
            for (const std::int32_t a : nodes)
                for (const std::int32_t b : edges[static_cast<std::size_t>(a)])
                    if (std::binary_search(nodes.begin(), nodes.end(), b))
                        more.push_back(middle(a, b));
        }
        nodes.insert(nodes.end(), more.begin(), more.end());
        std::sort(nodes.begin(), nodes.end());
        nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    }
    return mesh;
}

BarycentricMap map_into_linear(const TetMesh& quadratic, const TetMesh& linear) {
    BarycentricMap map;
    map.nodes.resize(quadratic.nodes.size());
    map.weights.resize(quadratic.nodes.size());
    map.distance.assign(quadratic.nodes.size(), 0);
    for (std::size_t e = 0; e < quadratic.tets.size(); ++e) {
        const Tet& t = linear.tets[e];
        for (int i = 0; i < 4; ++i) {
            const std::int32_t n = quadratic.tets[e][i];
            map.nodes[n] = t;
            map.weights[n] = {0, 0, 0, 0};
            map.weights[n][i] = 1;
        }
        for (int k = 0; k < 6; ++k) {
            const std::int32_t n = quadratic.edge_nodes[e][k];
            map.nodes[n] = t;
            map.weights[n] = {0, 0, 0, 0};
            for (const int end : tet_edges[k]) map.weights[n][end] = 0.5;
        }
    }
    return map;
}

MeshHierarchy with_quadratic_level(MeshHierarchy hierarchy) {
    TetMesh quadratic = quadratic_mesh(hierarchy.levels.front());
    BarycentricMap map = map_into_linear(quadratic, hierarchy.levels.front());
    std::vector<std::int32_t> parents(quadratic.tets.size());
    std::iota(parents.begin(), parents.end(), 0);
    hierarchy.parents.resize(hierarchy.transfers.size());
    hierarchy.parents.insert(hierarchy.parents.begin(), std::move(parents));
    hierarchy.levels.insert(hierarchy.levels.begin(), std::move(quadratic));
    hierarchy.transfers.insert(hierarchy.transfers.begin(), std::move(map));
    return hierarchy;
}

EdgeNodes::EdgeNodes(const TetMesh& mesh) {
    middles_.reserve(2 * mesh.edge_nodes.size());
    for (std::size_t e = 0; e < mesh.edge_nodes.size(); ++e)
        for (int k = 0; k < 6; ++k)
            middles_.try_emplace(
                edge_key(mesh.tets[e][tet_edges[k][0]], mesh.tets[e][tet_edges[k][1]]),
                mesh.edge_nodes[e][k]);
}

EdgeNodes::EdgeNodes(const TetMesh& mesh, std::span<const Triangle> triangles) {
    if (mesh.edge_nodes.empty()) return;
    std::vector<bool> is_corner(mesh.nodes.size(), false);
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) {
            is_corner[t[k]] = true;
            middles_.try_emplace(edge_key(t[k], t[(k + 1) % 3]), -1);
        }
    for (std::size_t e = 0; e < mesh.edge_nodes.size(); ++e)
        for (int k = 0; k < 6; ++k) {
            const std::int32_t a = mesh.tets[e][tet_edges[k][0]], b = mesh.tets[e][tet_edges[k][1]];
            if (!is_corner[a] || !is_corner[b]) continue;
            const auto found = middles_.find(edge_key(a, b));
            if (found != middles_.end()) found->second = mesh.edge_nodes[e][k];
        }
}

std::int32_t EdgeNodes::between(std::int32_t a, std::int32_t b) const {
    const auto found = middles_.find(edge_key(a, b));
    return found == middles_.end() ? -1 : found->second;
}

Vector3 interpolate(const BarycentricMap& map, const EdgeNodes& edges, std::size_t point,
                    std::span<const Vector3> values) {
    if (edges.empty()) return interpolate(map, point, values);
    Vector3 value = Vector3::Zero();
    const auto& nodes = map.nodes[point];
    const auto& L = map.weights[point];
    for (int i = 0; i < 4; ++i) {
        value += L[i] * (2 * L[i] - 1) * values[nodes[i]];
        for (int j = i + 1; j < 4; ++j)
            if (const double w = 4 * L[i] * L[j]; w != 0)
                value += w * values[edges.between(nodes[i], nodes[j])];
    }
    return value;
}

PointSampler PointSampler::after_cut(const TetMesh& before, const TetMesh& after) const {
    // A point outside has its tet's corners in another order.
    const Lists at_least_corner = make_lists(before.nodes.size(), [&](auto&& add) {
        for (std::size_t p = 0; p < map_.size(); ++p)
            add(*std::ranges::min_element(map_.nodes[p]), static_cast<std::int32_t>(p));
    });
    PointSampler cut = *this;
    cut.edges_ = EdgeNodes(after);
    for (std::size_t e = 0; e < before.tets.size(); ++e) {
        const Tet &was = before.tets[e], &is = after.tets[e];
        for (const std::int32_t p : at_least_corner[*std::ranges::min_element(was)]) {
            const Tet& corners = map_.nodes[p];
            if (!std::ranges::is_permutation(corners, was)) continue;
            Tet& now = cut.map_.nodes[p];
            for (int i = 0; i < 4; ++i)
                now[i] = is[std::ranges::find(was, corners[i]) - was.begin()];
            if (!std::ranges::equal(corners, now, [&](std::int32_t a, std::int32_t b) {
                    return before.nodes[a] == after.nodes[b];
                }))
                cut.map_.weights[p] = weights_in(
                    after, now, interpolate(map_, static_cast<std::size_t>(p), before.nodes));
        }
    }
    return cut;
}

std::vector<Vector3> PointSampler::sample(std::span<const Vector3> values) const {
    std::vector<Vector3> at_points;
    at_points.reserve(map_.size());
    for (std::size_t i = 0; i < map_.size(); ++i)
        at_points.push_back(interpolate(map_, edges_, i, values));
    return at_points;
}

namespace {

/// Adds the nodes between two corners of `nodes`, which are sorted, along the edges of `triangles`.
std::vector<std::int32_t> with_middles(const TetMesh& mesh, std::span<const Triangle> triangles,
                                       std::vector<std::int32_t> nodes) {
    if (mesh.edge_nodes.empty()) return nodes;
    const EdgeNodes edges(mesh, triangles);
    const std::size_t given = nodes.size();
    const auto has = [&](std::int32_t n) {
        return std::binary_search(nodes.begin(), nodes.begin() + given, n);
    };
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k)
            if (const std::int32_t a = t[k], b = t[(k + 1) % 3]; has(a) && has(b))
                nodes.push_back(edges.between(a, b));
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
}

}  // namespace

std::vector<std::int32_t> surface_nodes(const TetMesh& mesh) {
    const std::vector<Triangle> triangles = boundary_triangles(mesh.tets);
    return with_middles(mesh, triangles, nodes_of(triangles));
}

std::vector<std::int32_t> surface_nodes_among(const TetMesh& mesh,
                                              std::span<const std::int32_t> nodes) {
    std::vector<bool> is_given(mesh.nodes.size(), false);
    for (const std::int32_t n : nodes) is_given[n] = true;
    const auto given = [&](std::int32_t n) { return bool(is_given[n]); };
    // All tets at a face with a given node are among those at that node.
    std::vector<Tet> around;
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        if (const Tet& t = mesh.tets[e];
            std::any_of(t.begin(), t.end(), given) ||
            (!mesh.edge_nodes.empty() &&
             std::any_of(mesh.edge_nodes[e].begin(), mesh.edge_nodes[e].end(), given)))
            around.push_back(t);
    const std::vector<Triangle> triangles = boundary_triangles(around);
    std::vector<std::int32_t> found = with_middles(mesh, triangles, nodes_of(triangles));
    std::erase_if(found, [&](std::int32_t n) { return !is_given[n]; });
    return found;
}

std::vector<std::int32_t> with_edge_nodes_between(const TetMesh& mesh,
                                                  std::vector<std::int32_t> nodes) {
    std::sort(nodes.begin(), nodes.end());
    if (mesh.edge_nodes.empty()) return nodes;
    return with_middles(mesh, boundary_triangles(mesh.tets), std::move(nodes));
}

std::array<std::int32_t, 3> traction_nodes(const Triangle& t, const EdgeNodes& edges) {
    if (edges.empty()) return t;
    return {edges.between(t[0], t[1]), edges.between(t[1], t[2]), edges.between(t[2], t[0])};
}

}  // namespace livetet
