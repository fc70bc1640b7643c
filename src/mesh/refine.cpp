#include "mesh/refine.hpp"

#include <algorithm>
#include <limits>

#include "base/error.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

std::array<Tet, 8> children_of(const Tet& t, const std::array<std::int32_t, 6>& m,
                               std::span<const Vector3> places) {
    std::array<Tet, 8> children{Tet{t[0], m[0], m[2], m[3]}, Tet{m[0], t[1], m[1], m[4]},
                                Tet{m[2], m[1], t[2], m[5]}, Tet{m[3], m[4], m[5], t[3]}};
    // Each inner diagonal joins the midpoints of two opposite edges; the other four midpoints lie
    // around it.
    constexpr int diagonals[3][2] = {{0, 5}, {1, 3}, {2, 4}};
    constexpr int rings[3][4] = {{1, 2, 3, 4}, {0, 2, 5, 4}, {0, 1, 5, 3}};
    int shortest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int d = 0; d < 3; ++d) {
        const double length =
            (places[m[diagonals[d][0]]] - places[m[diagonals[d][1]]]).squaredNorm();
        if (length < least) least = length, shortest = d;
    }
    const int* ring = rings[shortest];
    for (int i = 0; i < 4; ++i) {
        Tet& inner = children[4 + i];
        inner = {m[diagonals[shortest][0]], m[diagonals[shortest][1]], m[ring[i]],
                 m[ring[(i + 1) % 4]]};
        const Vector3& x = places[inner[0]];
        if ((places[inner[1]] - x).cross(places[inner[2]] - x).dot(places[inner[3]] - x) < 0)
            std::swap(inner[2], inner[3]);
    }
    return children;
}

std::array<Triangle, 4> children_of(const Triangle& t, const Triangle& m) {
    return {Triangle{t[0], m[0], m[2]}, Triangle{m[0], t[1], m[1]}, Triangle{m[2], m[1], t[2]},
            Triangle{m[0], m[1], m[2]}};
}

void check_can_refine(std::size_t tets) {
    constexpr std::size_t most = std::numeric_limits<std::int32_t>::max();
    if (tets > most / 8) fail("refine: {} tets times eight, expected at most {}", tets, most);
}

namespace {

/// The number in the refined mesh of each node of the quadratic one.
std::vector<std::int32_t> numbers_in_refined(const TetMesh& quadratic) {
    const std::int32_t corners = corner_count(quadratic);
    std::vector<std::int32_t> lower_end(quadratic.nodes.size() - corners);
    for (std::size_t e = 0; e < quadratic.tets.size(); ++e)
        for (int k = 0; k < 6; ++k)
            lower_end[quadratic.edge_nodes[e][k] - corners] =
                std::min(quadratic.tets[e][tet_edges[k][0]], quadratic.tets[e][tet_edges[k][1]]);
    // Edges are numbered by their lower ends, so that these rise.
    std::vector<std::int32_t> number;
    number.reserve(quadratic.nodes.size());
    std::int32_t before = 0;
    for (std::int32_t n = 0; n < corners; ++n) {
        number.push_back(n + before);
        while (before < static_cast<std::int32_t>(lower_end.size()) && lower_end[before] == n)
            ++before;
    }
    for (std::int32_t k = 0; k < static_cast<std::int32_t>(lower_end.size()); ++k)
        number.push_back(lower_end[k] + 1 + k);
    return number;
}

/// `number`: of each node of the quadratic mesh in the refined one.
TetMesh refined_mesh(const TetMesh& quadratic, std::span<const std::int32_t> number) {
    TetMesh mesh;
    mesh.nodes.resize(quadratic.nodes.size());
    for (std::size_t n = 0; n < number.size(); ++n) mesh.nodes[number[n]] = quadratic.nodes[n];
    mesh.tets.reserve(8 * quadratic.tets.size());
    for (std::size_t e = 0; e < quadratic.tets.size(); ++e) {
        for (const Tet& child :
             children_of(quadratic.tets[e], quadratic.edge_nodes[e], quadratic.nodes)) {
            Tet& t = mesh.tets.emplace_back(child);
            for (std::int32_t& n : t) n = number[n];
        }
        if (!quadratic.regions.empty())
            mesh.regions.insert(mesh.regions.end(), 8, quadratic.regions[e]);
    }
    for (const auto& [name, nodes] : quadratic.node_sets) {
        std::vector<std::int32_t>& set = mesh.node_sets[name];
        for (const std::int32_t n : nodes) set.push_back(number[n]);
        std::sort(set.begin(), set.end());
    }
    for (const auto& [name, triangles] : quadratic.triangle_sets) {
        const EdgeNodes edges(quadratic, triangles);
        std::vector<Triangle>& set = mesh.triangle_sets[name];
        for (const Triangle& t : triangles)
            for (Triangle part : children_of(t, traction_nodes(t, edges))) {
                for (std::int32_t& n : part) n = number[n];
                set.push_back(part);
            }
    }
    return mesh;
}

}  // namespace

MeshHierarchy with_refined_levels(MeshHierarchy hierarchy, int times) {
    for (int i = 0; i < times; ++i) {
        const TetMesh& linear = hierarchy.levels.front();
        if (!linear.edge_nodes.empty())
            fail("refine: the finest level has ten-node tets, expected four-node ones");
        check_can_refine(linear.tets.size());
        const TetMesh quadratic = quadratic_mesh(linear);
        const std::vector<std::int32_t> number = numbers_in_refined(quadratic);
        const BarycentricMap places = map_into_linear(quadratic, linear);
        BarycentricMap map = places;
        for (std::size_t n = 0; n < number.size(); ++n) {
            map.nodes[number[n]] = places.nodes[n];
            map.weights[number[n]] = places.weights[n];
        }
        TetMesh mesh = refined_mesh(quadratic, number);
        std::vector<std::int32_t> parents(mesh.tets.size());
        for (std::size_t e = 0; e < parents.size(); ++e)
            parents[e] = static_cast<std::int32_t>(e / 8);
        hierarchy.levels.insert(hierarchy.levels.begin(), std::move(mesh));
        hierarchy.transfers.insert(hierarchy.transfers.begin(), std::move(map));
        hierarchy.parents.resize(hierarchy.transfers.size() - 1);
        hierarchy.parents.insert(hierarchy.parents.begin(), std::move(parents));
    }
    return hierarchy;
}

}  // namespace livetet
