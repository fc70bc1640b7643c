#include "mesh/grid_surface.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>

namespace livetet {

namespace {

/// Enough for steps a few cells wide to become a slope. Each carries the rounding of a body's edges
/// a cell further into its faces.
constexpr int relaxations = 8;
constexpr double farthest = 0.5;  // of an edge

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
    const auto edges = edges_of(surface);
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
    for (std::size_t n = 0; n < places.size(); ++n) places[n] += axes * moved[n];
    return places;
}

std::vector<Vector3> drawn_places(const TetMesh& mesh, std::span<const Triangle> surface) {
    return mesh.hexahedra.empty() ? mesh.nodes : smoothed_surface(mesh, surface);
}

}  // namespace livetet
