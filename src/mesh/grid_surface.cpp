#include "mesh/grid_surface.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <numeric>

namespace livetet {

namespace {

/// Enough for steps a few cells wide to become a slope. Each carries the rounding of a body's edges
/// a cell further into its faces.
constexpr int relaxations = 8;
constexpr double farthest = 0.5;  // of an edge

/// Of each node the one that stands for it: the first of those of `surface` at its place, of which
/// there are several where a cut has parted cells.
std::vector<std::int32_t> first_at_each_place(const TetMesh& grid,
                                              std::span<const Triangle> surface) {
    std::vector<std::int32_t> nodes = nodes_of(surface), first(grid.nodes.size());
    std::iota(first.begin(), first.end(), 0);
    const auto place = [&](std::int32_t n) {
        const Vector3& x = grid.nodes[n];
        return std::array{x.x(), x.y(), x.z()};
    };
    std::ranges::stable_sort(nodes, {}, place);
    for (std::size_t k = 1; k < nodes.size(); ++k)
        if (place(nodes[k]) == place(nodes[k - 1])) first[nodes[k]] = first[nodes[k - 1]];
    return first;
}

/// A surface by the nodes that stand for others, without the faces of a cut: their two sides lie
/// upon each other.
std::vector<Triangle> without_cuts(std::span<const Triangle> surface,
                                   std::span<const std::int32_t> first) {
    std::vector<Triangle> faces;
    for (Triangle t : surface) {
        for (std::int32_t& n : t) n = first[n];
        std::ranges::sort(t);
        faces.push_back(t);
    }
    std::ranges::sort(faces);
    std::vector<Triangle> outer;
    for (auto from = faces.begin(); from != faces.end();) {
        const auto to = std::find_if(from, faces.end(), [&](auto& t) { return t != *from; });
        if (to - from == 1) outer.push_back(*from);
        from = to;
    }
    return outer;
}

/// Pairs of neighbours, each once.
std::vector<std::array<std::int32_t, 2>> edges_of(std::span<const Triangle> surface) {
    std::vector<std::array<std::int32_t, 2>> edges;
    for (const Triangle& t : surface)
        for (int k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
            edges.push_back({low, high});
        }
    std::ranges::sort(edges);
    const auto rest = std::ranges::unique(edges);
    edges.erase(rest.begin(), rest.end());
    return edges;
}

}  // namespace

std::vector<Vector3> smoothed_surface(const TetMesh& grid, std::span<const Triangle> surface) {
    const Hexahedron& cell = grid.hexahedra.front();
    Eigen::Matrix3d axes;
    for (int d = 0; d < 3; ++d) axes.col(d) = grid.nodes[cell[1 << d]] - grid.nodes[cell[0]];
    const Eigen::Matrix3d in_cells = axes.inverse();
    // How far each node has moved, in cells.
    const std::vector<std::int32_t> first = first_at_each_place(grid, surface);
    const auto edges = edges_of(without_cuts(surface, first));
    std::vector<Vector3> moved(grid.nodes.size(), Vector3::Zero()), sum(moved);
    std::vector<int> count(grid.nodes.size(), 0);
    for (const auto& [a, b] : edges) ++count[a], ++count[b];
    for (int k = 0; k < relaxations; ++k) {
        std::ranges::fill(sum, Vector3::Zero());
        for (const auto& [a, b] : edges) {
            const Vector3 way = in_cells * (grid.nodes[b] - grid.nodes[a]) + moved[b] - moved[a];
            sum[a] += way;
            sum[b] -= way;
        }
        for (std::size_t n = 0; n < moved.size(); ++n)
            if (count[n] > 0)
                moved[n] = (moved[n] + sum[n] / count[n])
                               .cwiseMax(Vector3::Constant(-farthest))
                               .cwiseMin(Vector3::Constant(farthest));
    }
    std::vector<Vector3> places = grid.nodes;
    for (std::size_t n = 0; n < places.size(); ++n) places[n] += axes * moved[first[n]];
    return places;
}

std::vector<Vector3> drawn_places(const TetMesh& mesh, std::span<const Triangle> surface) {
    return mesh.hexahedra.empty() ? mesh.nodes : smoothed_surface(mesh, surface);
}

}  // namespace livetet
