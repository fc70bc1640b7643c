#include "apps/scene/node_selection.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "base/error.hpp"
#include "image/mask_selection.hpp"
#include "io/image_file.hpp"
#include "mesh/node_selection.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

std::vector<std::int32_t> selected(const TetMesh& mesh, const SelectionOptions& s,
                                   const std::string& key) {
    const auto mm = [](double x, double y, double z) -> Vector3 { return Vector3(x, y, z) / 1e3; };
    if (s.mask) return nodes_in_mask(mesh, read_mask(*s.mask));
    if (s.group) {
        const auto found = mesh.node_sets.find(*s.group);
        if (found != mesh.node_sets.end()) return found->second;
        std::vector<std::string> names;
        for (const auto& [name, nodes] : mesh.node_sets) names.push_back(name);
        fail("{}.group = {}: the mesh has no set of that name, it has {}", key, *s.group,
             names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
    }
    if (s.box_mm) {
        const auto& b = *s.box_mm;
        return nodes_in_box(mesh, mm(b[0], b[1], b[2]), mm(b[3], b[4], b[5]));
    }
    if (s.sphere_mm) {
        const auto& b = *s.sphere_mm;
        return nodes_in_sphere(mesh, mm(b[0], b[1], b[2]), b[3] / 1e3);
    }
    if (s.half_space_mm) {
        const auto& b = *s.half_space_mm;
        return nodes_in_half_space(mesh, mm(b[0], b[1], b[2]), Vector3(b[3], b[4], b[5]));
    }
    std::vector<std::int32_t> nodes(s.nodes->begin(), s.nodes->end());
    for (const std::int32_t n : nodes)
        if (n < 0 || n >= static_cast<std::int32_t>(mesh.nodes.size()))
            fail("{}.nodes names node {}, expected 0 to {}", key, n, mesh.nodes.size() - 1);
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
}

}  // namespace

std::vector<std::int32_t> select_nodes(const TetMesh& mesh, const SelectionOptions& s,
                                       const std::string& key) {
    std::vector<std::int32_t> nodes = selected(mesh, s, key);
    if (s.where == NodeScope::surface_only) nodes = surface_nodes_among(mesh, nodes);
    if (nodes.empty()) {
        Vector3 low = mesh.nodes.front(), high = low;
        for (const Vector3& x : mesh.nodes) {
            low = low.cwiseMin(x);
            high = high.cwiseMax(x);
        }
        fail(
            "{} selects no node; the mesh spans ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, "
            "{:.1f}) mm",
            key, 1e3 * low.x(), 1e3 * low.y(), 1e3 * low.z(), 1e3 * high.x(), 1e3 * high.y(),
            1e3 * high.z());
    }
    return nodes;
}

}  // namespace livetet
