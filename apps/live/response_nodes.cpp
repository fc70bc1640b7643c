#include "apps/live/response_nodes.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <algorithm>

#include "apps/scene/node_selection.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

void list_selected_nodes(Scene& scene, const TetMesh& mesh) {
    const auto list = [&](auto& sets, std::string_view name) {
        for (std::size_t i = 0; i < sets.size(); ++i) {
            SelectionOptions& selection = sets[i];
            const auto nodes = select_nodes(mesh, selection, fmt::format("{}[{}]", name, i));
            const NodeScope where = selection.where;
            selection = {};
            selection.nodes.emplace(nodes.begin(), nodes.end());
            std::ranges::sort(*selection.nodes);
            selection.where = where;
        }
    };
    list(scene.fix, "fix");
    list(scene.drive, "drive");
}

Holding scene_holding(const Scene& scene, const TetMesh& mesh) {
    const SceneConstraints fixed(scene, mesh);
    Holding held{fixed.constraints(), fixed.springs()};
    std::fill(held.constraints.values.begin(), held.constraints.values.end(), Vector3::Zero());
    std::fill(held.springs.target.begin(), held.springs.target.end(), Vector3::Zero());
    return held;
}

std::vector<int> widened(const TetMesh& mesh, const std::vector<int>& set, NodeScope where,
                         double distance) {
    const std::vector<std::int32_t> surface = selectable_surface(mesh);
    std::vector<std::uint8_t> is_in(mesh.nodes.size(), 0);
    for (const int n : set) is_in[n] = 1;
    std::vector<Vector3> of_set;
    Eigen::AlignedBox3d near;
    for (const std::int32_t n : surface)
        if (is_in[n]) {
            of_set.push_back(mesh.nodes[n]);
            near.extend(mesh.nodes[n]);
        }
    const auto take = [&](std::int32_t n) {
        const Vector3& x = mesh.nodes[n];
        if (is_in[n] || of_set.empty() || near.exteriorDistance(x) > distance) return;
        is_in[n] = std::ranges::any_of(
            of_set, [&](const Vector3& place) { return (place - x).norm() <= distance; });
    };
    if (where == NodeScope::surface_only)
        std::ranges::for_each(surface, take);
    else
        for (std::size_t n = 0; n < is_in.size(); ++n) take(static_cast<std::int32_t>(n));
    std::vector<int> all;
    for (std::size_t n = 0; n < is_in.size(); ++n)
        if (is_in[n]) all.push_back(static_cast<int>(n));
    return all;
}

std::vector<std::int32_t> nearest_on_surface(const TetMesh& coarse, const TetMesh& fine) {
    std::vector<std::int32_t> nearest(coarse.nodes.size(), -1);
    const std::vector<std::int32_t> candidates = surface_nodes(fine);
    for (const std::int32_t n : surface_nodes(coarse))
        nearest[n] = *std::ranges::min_element(candidates, {}, [&](std::int32_t c) {
            return (fine.nodes[c] - coarse.nodes[n]).squaredNorm();
        });
    return nearest;
}

Holding on_other_nodes(const Holding& held, std::span<const std::int32_t> others) {
    Holding other{Constraints(others.size()), {}};
    for (std::size_t n = 0; n < others.size(); ++n)
        if (others[n] >= 0)
            other.constraints.components[n] = held.constraints.components[others[n]];
    return other;
}

}  // namespace livetet
