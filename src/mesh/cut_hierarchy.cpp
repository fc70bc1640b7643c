#include "mesh/cut_hierarchy.hpp"

#include <algorithm>

#include "base/sliced_task.hpp"
#include "mesh/mesh_pieces.hpp"
#include "mesh/point_locator.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/segment_crossings.hpp"
#include "mesh/side_finder.hpp"
#include "mesh/tet_cut.hpp"
#include "mesh/tet_weights.hpp"

namespace livetet {

namespace {

/// How far a point that stands for a node of the boundary lies towards the midst of its tets.
constexpr double way_inside = 0.25;

/// The mean of the middles of each node's tets.
std::vector<Vector3> midst_of_tets(const TetMesh& mesh) {
    std::vector<Vector3> midst(mesh.nodes.size(), Vector3::Zero());
    std::vector<double> count(mesh.nodes.size(), 0);
    for (const Tet& t : mesh.tets) {
        const Vector3 middle =
            (mesh.nodes[t[0]] + mesh.nodes[t[1]] + mesh.nodes[t[2]] + mesh.nodes[t[3]]) / 4;
        for (const std::int32_t n : t) midst[n] += middle, ++count[n];
    }
    for (std::size_t n = 0; n < midst.size(); ++n) midst[n] /= count[n];
    return midst;
}

/// Maps the fine nodes that are in coarse tets near gaps into tets on their own side; a node that
/// has none there keeps the tet that `points`, one a node, found.
void keep_to_own_side(BarycentricMap& map, const TetMesh& fine, const PointLocator& in_fine,
                      const TetMesh& coarse, std::span<const Vector3> points) {
    SideFinder finder(fine, in_fine, coarse);
    if (!finder.knows_gaps()) return;
    const PointLocator locator(coarse);
    pause_point();
    for (std::size_t n = 0; n < map.size(); ++n) {
        if (n % 64 == 0) pause_point();
        if (!finder.is_near_gap(map.nodes[n])) continue;
        const std::int32_t found = locator.find(points[n]).tet;
        const HoldingTet beside = finder.tet_beside(static_cast<std::int32_t>(n), found);
        if (beside.tet < 0 || beside.tet == found) continue;
        map.nodes[n] = coarse.tets[beside.tet];
        map.weights[n] = extrapolated_weights(inside_weights(beside.weights), beside.weights);
    }
}

/// Of the nodes of a cut level in the next coarser one, each side of a cut in its own side.
BarycentricMap map_across(const TetMesh& fine, const TetMesh& coarse) {
    const PointLocator in_fine(fine);
    const std::vector<std::int32_t> on_boundary = nodes_of(in_fine.boundary());
    pause_point();
    const std::vector<Vector3> midst = midst_of_tets(fine);
    std::vector<Vector3> points = fine.nodes;
    for (const std::int32_t n : on_boundary) points[n] += way_inside * (midst[n] - points[n]);
    BarycentricMap map = map_into(coarse, points, Outside::extrapolated);
    for (const std::int32_t n : on_boundary) {
        const auto weights = weights_in(coarse, map.nodes[n], fine.nodes[n]);
        if (*std::ranges::min_element(weights) >= min_extrapolated_weight) map.weights[n] = weights;
    }
    pause_point();
    keep_to_own_side(map, fine, in_fine, coarse, points);
    return map;
}

}  // namespace

CutCounts cut_levels(std::vector<TetMesh>& levels, const CutSurface& surface,
                     const std::string& where) {
    CutCounts counts;
    for (TetMesh& level : levels) {
        const SegmentCrossings crossings(surface, level.nodes, where);
        CutTets cut = cut_tets(std::move(level), crossings);
        if (&level == &levels.front()) counts = cut.counts;
        level = std::move(cut.mesh);
    }
    return counts;
}

MeshHierarchy with_cut_transfers(std::vector<TetMesh> levels, std::string provenance) {
    MeshHierarchy hierarchy{std::move(levels), {}, std::move(provenance)};
    for (std::size_t l = 0; l + 1 < hierarchy.levels.size(); ++l) {
        const TetMesh &fine = hierarchy.levels[l], &coarse = hierarchy.levels[l + 1];
        hierarchy.transfers.push_back(fine.edge_nodes.empty() ? map_across(fine, coarse)
                                                              : map_into_linear(fine, coarse));
        pause_point();
    }
    check_hierarchy(hierarchy);
    return hierarchy;
}

std::vector<TetMesh> without_tets(std::vector<TetMesh> levels,
                                  std::span<const std::uint8_t> left_out) {
    std::vector<TetMesh> kept{without_cells(levels.front(), left_out)};
    for (std::size_t l = 1; l < levels.size(); ++l) {
        const BarycentricMap map = map_across(kept.back(), levels[l]);
        std::vector<std::uint8_t> is_used(levels[l].nodes.size(), 0);
        for (const auto& corners : map.nodes)
            for (const std::int32_t n : corners) is_used[n] = 1;
        std::vector<std::uint8_t> is_unused(levels[l].tets.size(), 0);
        for (const MeshPiece& piece : mesh_pieces(levels[l])) {
            const auto nodes = nodes_of_pieces({&piece, 1}, levels[l]);
            if (std::ranges::none_of(nodes, [&](std::int32_t n) { return is_used[n] != 0; }))
                for (const std::int32_t e : piece.cells) is_unused[e] = 1;
        }
        TetMesh coarse = without_cells(levels[l], is_unused);
        if (coarse.tets.size() < kept.back().tets.size()) kept.push_back(std::move(coarse));
    }
    return kept;
}

}  // namespace livetet
