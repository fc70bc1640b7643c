#include "meshing/refine.hpp"

#include <limits>

#include "base/error.hpp"
#include "mesh/quadratic.hpp"
#include "meshing/locality.hpp"

namespace livetet {

namespace {

/// The four tets around the diagonal between the midpoints `a` and `b` of opposite edges. `ring`:
/// the other four midpoints in order around it.
void add_inner_tets(TetMesh& mesh, std::int32_t a, std::int32_t b,
                    const std::array<std::int32_t, 4>& ring) {
    for (int i = 0; i < 4; ++i) {
        Tet t{a, b, ring[i], ring[(i + 1) % 4]};
        if (signed_volume(mesh, t) < 0) std::swap(t[2], t[3]);
        mesh.tets.push_back(t);
    }
}

TetMesh refined_mesh(const TetMesh& quadratic) {
    TetMesh mesh;
    mesh.nodes = quadratic.nodes;
    mesh.node_sets = quadratic.node_sets;
    mesh.tets.reserve(8 * quadratic.tets.size());
    for (std::size_t e = 0; e < quadratic.tets.size(); ++e) {
        const Tet& t = quadratic.tets[e];
        const auto& m = quadratic.edge_nodes[e];  // midpoints of 01, 12, 20, 03, 13, 23
        for (const Tet& corner : {Tet{t[0], m[0], m[2], m[3]}, Tet{m[0], t[1], m[1], m[4]},
                                  Tet{m[2], m[1], t[2], m[5]}, Tet{m[3], m[4], m[5], t[3]}})
            mesh.tets.push_back(corner);
        const auto length = [&](std::int32_t a, std::int32_t b) {
            return (mesh.nodes[a] - mesh.nodes[b]).squaredNorm();
        };
        const double d[3] = {length(m[0], m[5]), length(m[1], m[3]), length(m[2], m[4])};
        if (d[0] <= d[1] && d[0] <= d[2])
            add_inner_tets(mesh, m[0], m[5], {m[1], m[2], m[3], m[4]});
        else if (d[1] <= d[2])
            add_inner_tets(mesh, m[1], m[3], {m[0], m[2], m[5], m[4]});
        else
            add_inner_tets(mesh, m[2], m[4], {m[0], m[1], m[5], m[3]});
        if (!quadratic.regions.empty())
            mesh.regions.insert(mesh.regions.end(), 8, quadratic.regions[e]);
    }
    const EdgeNodes edges(quadratic);
    for (const auto& [name, triangles] : quadratic.triangle_sets)
        for (const Triangle& t : triangles) {
            const std::int32_t a = edges.between(t[0], t[1]), b = edges.between(t[1], t[2]),
                               c = edges.between(t[2], t[0]);
            for (const Triangle& part : {Triangle{t[0], a, c}, Triangle{a, t[1], b},
                                         Triangle{c, b, t[2]}, Triangle{a, b, c}})
                mesh.triangle_sets[name].push_back(part);
        }
    return mesh;
}

}  // namespace

MeshHierarchy with_refined_levels(MeshHierarchy hierarchy, int times) {
    for (int i = 0; i < times; ++i) {
        const TetMesh& linear = hierarchy.levels.front();
        if (!linear.edge_nodes.empty())
            fail("refine: the finest level has ten-node tets, expected four-node ones");
        if (linear.tets.size() >
            static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()) / 8)
            fail("refine: {} tets times eight, expected at most {}", linear.tets.size(),
                 std::numeric_limits<std::int32_t>::max());
        const TetMesh quadratic = quadratic_mesh(linear);
        const BarycentricMap places = map_into_linear(quadratic);
        TetMesh mesh = refined_mesh(quadratic);
        const Renumbering order = sort_for_locality(mesh);
        const std::vector<std::int32_t>& number = order.number_of_node;
        std::vector<std::int32_t> parents;
        for (const std::int32_t e : order.tets) parents.push_back(e / 8);
        BarycentricMap map = places;
        for (std::size_t n = 0; n < number.size(); ++n) {
            map.nodes[number[n]] = places.nodes[n];
            map.weights[number[n]] = places.weights[n];
        }
        hierarchy.levels.insert(hierarchy.levels.begin(), std::move(mesh));
        hierarchy.transfers.insert(hierarchy.transfers.begin(), std::move(map));
        hierarchy.parents.resize(hierarchy.transfers.size() - 1);
        hierarchy.parents.insert(hierarchy.parents.begin(), std::move(parents));
    }
    return hierarchy;
}

}  // namespace livetet
