#include "mesh/tet_mesh.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <numeric>

#include "base/error.hpp"
#include "base/sliced_task.hpp"
#include "mesh/tet_faces.hpp"

namespace livetet {

double signed_volume(const TetMesh& mesh, const Tet& t) { return signed_volume(mesh.nodes, t); }

double signed_volume(std::span<const Vector3> nodes, const Tet& t) {
    const Vector3 a = nodes[t[1]] - nodes[t[0]];
    const Vector3 b = nodes[t[2]] - nodes[t[0]];
    const Vector3 c = nodes[t[3]] - nodes[t[0]];
    return a.dot(b.cross(c)) / 6;
}

double volume(const TetMesh& mesh) {
    return std::transform_reduce(mesh.tets.begin(), mesh.tets.end(), 0.0, std::plus{},
                                 [&](const Tet& t) { return signed_volume(mesh, t); });
}

std::vector<Triangle> boundary_triangles(std::span<const Tet> tets) {
    if (tets.size() > (std::size_t{1} << 30))
        fail("surface of a mesh: found {} tets, expected at most 2^30", tets.size());
    const auto wound = [&](std::size_t face) {
        const Tet& t = tets[face / 4];
        const auto& f = tet_faces[face % 4];
        return Triangle{t[f[0]], t[f[1]], t[f[2]]};
    };
    // Faces by their lowest node: the few at one node are compared with each other.
    std::int32_t node_count = 0;
    for (const Tet& t : tets)
        node_count = std::max(node_count, *std::max_element(t.begin(), t.end()) + 1);
    std::vector<std::size_t> end(static_cast<std::size_t>(node_count) + 1, 0);
    const auto lowest = [](const Triangle& t) { return *std::min_element(t.begin(), t.end()); };
    for (std::size_t face = 0; face < 4 * tets.size(); ++face) ++end[lowest(wound(face)) + 1];
    std::partial_sum(end.begin(), end.end(), end.begin());
    pause_point();
    std::vector<std::uint32_t> faces(4 * tets.size());
    for (std::size_t face = 0; face < faces.size(); ++face)  // end[n] moves to the end of node n
        faces[end[lowest(wound(face))]++] = static_cast<std::uint32_t>(face);

    struct Face {
        Triangle sorted;
        std::uint32_t number;
        bool operator<(const Face& other) const { return sorted < other.sorted; }
    };
    std::vector<Face> at_node;
    std::vector<bool> is_boundary(faces.size(), false);
    for (std::int32_t n = 0; n < node_count; ++n) {
        pause_point_at(static_cast<std::size_t>(n));
        at_node.clear();
        for (std::size_t i = n > 0 ? end[n - 1] : 0; i < end[n]; ++i) {
            Triangle sorted = wound(faces[i]);
            std::sort(sorted.begin(), sorted.end());
            at_node.push_back({sorted, faces[i]});
        }
        std::sort(at_node.begin(), at_node.end());
        for (auto face = at_node.begin(); face != at_node.end();) {
            const auto next = std::upper_bound(face, at_node.end(), *face);
            if (next - face == 1) is_boundary[face->number] = true;
            face = next;
        }
    }
    std::vector<std::uint32_t>().swap(faces);
    std::vector<Triangle> boundary;
    for (std::size_t face = 0; face < is_boundary.size(); ++face)
        if (is_boundary[face]) boundary.push_back(wound(face));
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

void check_rows(const TetMesh& rows, const MeshSize& size, const MeshSize& first,
                const std::string& where) {
    const auto check = [&](std::size_t tet, std::int32_t n, const char* what) {
        if (n < 0 || static_cast<std::size_t>(n) >= size.nodes)
            fail("{}: tet {} names {} {}, expected 0 to {}", where, first.tets + tet, what, n,
                 static_cast<std::int64_t>(size.nodes) - 1);
    };
    for (std::size_t e = 0; e < rows.tets.size(); ++e)
        for (const std::int32_t n : rows.tets[e]) check(e, n, "node");
    for (std::size_t e = 0; e < rows.edge_nodes.size(); ++e)
        for (const std::int32_t n : rows.edge_nodes[e]) check(e, n, "edge node");
    for (std::size_t n = 0; n < rows.nodes.size(); ++n)
        if (!rows.nodes[n].allFinite())
            fail("{}: node {} has a coordinate that is not finite", where, first.nodes + n);
}

void check_volumes(std::span<const Vector3> nodes, std::span<const Tet> tets,
                   std::span<const std::int32_t> numbers, const std::string& where) {
    for (std::size_t e = 0; e < tets.size(); ++e) {
        const double v = signed_volume(nodes, tets[e]);
        if (v > 0) continue;
        Vector3 centre = Vector3::Zero();
        for (const std::int32_t n : tets[e]) centre += nodes[n] / 4;
        fail(
            "{}: tet {} at ({:.2f}, {:.2f}, {:.2f}) mm is {} (volume {:.3g} mm^3), expected a "
            "positive volume",
            where, numbers.empty() ? static_cast<std::int64_t>(e) : numbers[e], 1e3 * centre.x(),
            1e3 * centre.y(), 1e3 * centre.z(), v < 0 ? "inverted" : "flat", 1e9 * v);
    }
}

void check_tet_mesh(const TetMesh& mesh, const std::string& where) {
    if (mesh.tets.empty()) fail("{}: the mesh has no tetrahedra, expected at least one", where);
    if (!mesh.edge_nodes.empty() && mesh.edge_nodes.size() != mesh.tets.size())
        fail("{}: {} sets of edge nodes for {} tets, expected one each", where,
             mesh.edge_nodes.size(), mesh.tets.size());
    check_rows(mesh, {mesh.nodes.size(), mesh.tets.size()}, {}, where);
    std::vector<bool> used(mesh.nodes.size(), false);
    for (const Tet& t : mesh.tets)
        for (const std::int32_t n : t) used[n] = true;
    for (const auto& edges : mesh.edge_nodes)
        for (const std::int32_t n : edges) used[n] = true;
    if (const auto found = std::find(used.begin(), used.end(), false); found != used.end())
        fail("{}: node {} belongs to no tet", where, found - used.begin());
    check_volumes(mesh.nodes, mesh.tets, {}, where);
    if (!mesh.regions.empty() && mesh.regions.size() != mesh.tets.size())
        fail("{}: {} region labels for {} tets, expected one each", where, mesh.regions.size(),
             mesh.tets.size());
}

}  // namespace livetet
