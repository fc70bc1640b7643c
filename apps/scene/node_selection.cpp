#include "apps/scene/node_selection.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "base/error.hpp"
#include "geometry/bounding_box.hpp"
#include "image/mask_selection.hpp"
#include "io/image_file.hpp"
#include "mesh/grid_border.hpp"
#include "mesh/node_selection.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

std::vector<std::int32_t> listed(const MeshPart& part, const SelectionOptions& s,
                                 const std::string& key) {
    for (const std::int32_t n : *s.nodes)
        if (n < 0 || n >= static_cast<std::int64_t>(part.total()))
            fail("{}.nodes names node {}, expected 0 to {}", key, n, part.total() - 1);
    const std::set<std::int32_t> wanted(s.nodes->begin(), s.nodes->end());
    std::vector<std::int32_t> nodes;
    for (std::size_t n = 0; n < part.mesh().nodes.size(); ++n)
        if (const auto local = static_cast<std::int32_t>(n); wanted.contains(part.number(local)))
            nodes.push_back(local);
    return nodes;
}

std::vector<std::int32_t> selected(const MeshPart& part, const SelectionOptions& s,
                                   const std::string& key) {
    const TetMesh& mesh = part.mesh();
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
    return listed(part, s, key);
}

/// Surface nodes, sorted, that were on the surface before the scene's cuts.
std::vector<std::int32_t> less_walls(const TetMesh& mesh, std::vector<std::int32_t> surface) {
    const auto before = mesh.node_sets.find(surface_before_cuts);
    if (before == mesh.node_sets.end()) return surface;
    std::vector<std::int32_t> found;
    std::ranges::set_intersection(surface, before->second, std::back_inserter(found));
    return found;
}

/// Sorted.
std::vector<std::int32_t> surface_among(const TetMesh& mesh, std::span<const std::int32_t> nodes) {
    if (mesh.shares.empty()) return surface_nodes_among(mesh, nodes);
    std::vector<std::int32_t> sorted(nodes.begin(), nodes.end()), found;
    std::ranges::sort(sorted);
    std::ranges::set_intersection(border_nodes(mesh), sorted, std::back_inserter(found));
    return found;
}

/// Of local nodes those on the surface, less walls of cuts. What is around a ghost is known to its
/// owner alone.
std::vector<std::int32_t> on_surface(const MeshPart& part, std::span<const std::int32_t> nodes) {
    std::vector<std::uint8_t> is_in(part.mesh().nodes.size(), 0);
    for (const std::int32_t n : surface_among(part.mesh(), nodes)) is_in[n] = 1;
    part.take_ghosts(is_in);
    std::vector<std::int32_t> found;
    for (std::size_t n = 0; n < is_in.size(); ++n)
        if (is_in[n]) found.push_back(static_cast<std::int32_t>(n));
    return less_walls(part.mesh(), std::move(found));
}

/// Of the whole mesh, m.
Eigen::AlignedBox3d whole_box(const MeshPart& part) {
    Eigen::AlignedBox3d box = box_of(part.mesh().nodes);
    if (part.comm() != MPI_COMM_SELF) {
        MPI_Allreduce(MPI_IN_PLACE, box.min().data(), 3, MPI_DOUBLE, MPI_MIN, part.comm());
        MPI_Allreduce(MPI_IN_PLACE, box.max().data(), 3, MPI_DOUBLE, MPI_MAX, part.comm());
    }
    return box;
}

}  // namespace

std::vector<std::int32_t> selectable_surface(const TetMesh& mesh) {
    return less_walls(mesh, mesh.shares.empty() ? surface_nodes(mesh) : border_nodes(mesh));
}

std::vector<std::int32_t> select_nodes(const MeshPart& part, const SelectionOptions& s,
                                       const std::string& key) {
    std::vector<std::int32_t> nodes = selected(part, s, key);
    if (s.where == NodeScope::surface_only) nodes = on_surface(part, nodes);
    if (part.count(nodes) == 0) {
        const Eigen::AlignedBox3d box = whole_box(part);
        const Vector3 low = box.min(), high = box.max();
        fail(
            "{} selects no node; the mesh spans ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, "
            "{:.1f}) mm",
            key, 1e3 * low.x(), 1e3 * low.y(), 1e3 * low.z(), 1e3 * high.x(), 1e3 * high.y(),
            1e3 * high.z());
    }
    return nodes;
}

std::vector<double> shares_of_nodes(const MeshPart& part, std::span<const std::int32_t> nodes) {
    if (part.mesh().shares.empty())
        return std::vector<double>(nodes.size(), 1.0 / static_cast<double>(part.count(nodes)));
    const std::vector<double> tissue = tissue_around(part.mesh());  // grids are on one rank
    std::vector<double> shares;
    double sum = 0;
    for (const std::int32_t n : nodes) {
        shares.push_back(tissue[n]);
        sum += tissue[n];
    }
    for (double& share : shares) share /= sum;
    return shares;
}

}  // namespace livetet
