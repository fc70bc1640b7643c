#include "mesh/tet_mesh.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <numeric>

#include "base/error.hpp"
#include "mesh/tet_faces.hpp"

namespace livetet {

double signed_volume(const TetMesh& mesh, const Tet& t) {
    const Vector3 a = mesh.nodes[t[1]] - mesh.nodes[t[0]];
    const Vector3 b = mesh.nodes[t[2]] - mesh.nodes[t[0]];
    const Vector3 c = mesh.nodes[t[3]] - mesh.nodes[t[0]];
    return a.dot(b.cross(c)) / 6;
}

double volume(const TetMesh& mesh) {
    return std::transform_reduce(mesh.tets.begin(), mesh.tets.end(), 0.0, std::plus{},
                                 [&](const Tet& t) { return signed_volume(mesh, t); });
}

std::vector<Triangle> boundary_triangles(std::span<const Tet> tets) {
    struct Face {
        Triangle sorted, wound;
        std::size_t order;
    };
    std::vector<Face> all;
    all.reserve(4 * tets.size());
    for (const Tet& t : tets)
        for (const auto& f : tet_faces) {
            const Triangle wound{t[f[0]], t[f[1]], t[f[2]]};
            Triangle sorted = wound;
            std::sort(sorted.begin(), sorted.end());
            all.push_back({sorted, wound, all.size()});
        }
    std::sort(all.begin(), all.end(),
              [](const Face& a, const Face& b) { return a.sorted < b.sorted; });
    std::vector<Face> kept;
    for (std::size_t i = 0; i < all.size();) {
        std::size_t j = i + 1;
        while (j < all.size() && all[j].sorted == all[i].sorted) ++j;
        if (j == i + 1) kept.push_back(all[i]);
        i = j;
    }
    std::sort(kept.begin(), kept.end(),
              [](const Face& a, const Face& b) { return a.order < b.order; });
    std::vector<Triangle> boundary;
    boundary.reserve(kept.size());
    for (const Face& f : kept) boundary.push_back(f.wound);
    return boundary;
}

std::vector<std::int32_t> nodes_of(std::span<const Triangle> triangles) {
    std::vector<std::int32_t> nodes;
    nodes.reserve(3 * triangles.size());
    for (const Triangle& t : triangles) nodes.insert(nodes.end(), t.begin(), t.end());
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
}

const std::vector<std::int32_t>& node_set(const TetMesh& mesh, std::string_view name) {
    const auto found = mesh.node_sets.find(std::string(name));
    if (found != mesh.node_sets.end()) return found->second;
    std::string names;
    for (const auto& [other, nodes] : mesh.node_sets) names += (names.empty() ? "" : ", ") + other;
    fail("no node set \"{}\", found {}", name, names.empty() ? "none" : names);
}

void drop_unused_nodes(TetMesh& mesh, std::size_t kept) {
    std::vector<std::int32_t> number(mesh.nodes.size(), -1);
    for (const Tet& t : mesh.tets)
        for (const std::int32_t n : t) number[n] = 0;
    std::int32_t count = 0;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        if (number[n] < 0 && n >= kept) continue;
        mesh.nodes[count] = mesh.nodes[n];
        number[n] = count++;
    }
    mesh.nodes.resize(count);
    for (Tet& t : mesh.tets)
        for (std::int32_t& n : t) n = number[n];
}

void check_tet_mesh(const TetMesh& mesh, const std::string& where) {
    if (mesh.tets.empty()) fail("{}: the mesh has no tetrahedra, expected at least one", where);
    const auto count = static_cast<std::int32_t>(mesh.nodes.size());
    std::vector<bool> used(mesh.nodes.size(), false);
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        for (const std::int32_t n : mesh.tets[e]) {
            if (n < 0 || n >= count)
                fail("{}: tet {} names node {}, expected 0 to {}", where, e, n, count - 1);
            used[n] = true;
        }
    if (!mesh.edge_nodes.empty() && mesh.edge_nodes.size() != mesh.tets.size())
        fail("{}: {} sets of edge nodes for {} tets, expected one each", where,
             mesh.edge_nodes.size(), mesh.tets.size());
    for (std::size_t e = 0; e < mesh.edge_nodes.size(); ++e)
        for (const std::int32_t n : mesh.edge_nodes[e]) {
            if (n < 0 || n >= count)
                fail("{}: tet {} names edge node {}, expected 0 to {}", where, e, n, count - 1);
            used[n] = true;
        }
    for (std::int32_t n = 0; n < count; ++n) {
        if (!mesh.nodes[n].allFinite())
            fail("{}: node {} has a coordinate that is not finite", where, n);
        if (!used[n]) fail("{}: node {} belongs to no tet", where, n);
    }
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        const double v = signed_volume(mesh, mesh.tets[e]);
        if (v > 0) continue;
        Vector3 centre = Vector3::Zero();
        for (const std::int32_t n : mesh.tets[e]) centre += mesh.nodes[n] / 4;
        fail(
            "{}: tet {} at ({:.2f}, {:.2f}, {:.2f}) mm is {} (volume {:.3g} mm^3), expected a "
            "positive volume",
            where, e, 1e3 * centre.x(), 1e3 * centre.y(), 1e3 * centre.z(),
            v < 0 ? "inverted" : "flat", 1e9 * v);
    }
    if (!mesh.regions.empty() && mesh.regions.size() != mesh.tets.size())
        fail("{}: {} region labels for {} tets, expected one each", where, mesh.regions.size(),
             mesh.tets.size());
}

}  // namespace livetet
