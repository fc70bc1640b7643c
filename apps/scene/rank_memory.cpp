#include "apps/scene/rank_memory.hpp"

#include <algorithm>
#include <cmath>

#include "mesh/mesh_edges.hpp"
#include "solvers/parallel/partition.hpp"

namespace livetet {

namespace {

/// A tet's corners, its place in the dual graph, and the coarser graphs. Measured.
constexpr double metis_bytes_a_tet = 200;

/// 3x3 blocks in the operator; of a P1 mesh one for each node and two for each edge.
double block_count(const TetMesh& mesh) {
    const auto nodes = static_cast<double>(mesh.nodes.size());
    if (!mesh.edge_nodes.empty()) return 28 * nodes;
    const auto edges = edges_by_lower_end(mesh.tets, mesh.nodes.size()).items.size();
    return nodes + 2 * static_cast<double>(edges);
}

}  // namespace

LevelSize size_of_level(const TetMesh& mesh, bool has_matrix) {
    const bool linear = mesh.edge_nodes.empty();
    const auto nodes = static_cast<double>(mesh.nodes.size()),
               tets = static_cast<double>(mesh.tets.size());
    // A block with its column; for each tet its gradients, rotations, nodes and block indices, or
    // the first three in both precisions; for each node its vectors, constraints and row of a
    // transfer.
    const double operator_bytes = has_matrix ? 76 * block_count(mesh) + (linear ? 228 : 470) * tets
                                             : (linear ? 340 : 1160) * tets;
    // For each tet its nodes; for each node its place and its row of the transfer.
    return {mesh.tets.size(), mesh.nodes.size(), operator_bytes + 600 * nodes,
            (linear ? 16.0 : 40.0) * tets + 72.0 * nodes};
}

RankMemory memory_of_rank(std::span<const LevelSize> levels, int ranks, int of_ranks,
                          std::size_t tets_of_metis) {
    RankMemory memory{.program = 57e6};
    for (std::size_t l = 0; l < levels.size(); ++l) {
        const LevelSize& level = levels[l];
        // As partition_levels shares a level out; each part has a layer of nodes around it.
        const auto parts =
            static_cast<double>(std::clamp<std::size_t>(level.tets / min_tets_per_rank, 1, ranks));
        const double layer = parts > 1 ? std::cbrt(parts / static_cast<double>(level.nodes)) : 0;
        memory.own += level.bytes / parts * std::pow(1 + layer, 3);
        if (ranks == 1 || l >= static_cast<std::size_t>(of_ranks))
            memory.whole += level.mesh_bytes / ranks;
    }
    if (ranks == 1) return memory;
    memory.whole += metis_bytes_a_tet * static_cast<double>(tets_of_metis);
    // Elements and operators come when that has gone.
    memory.whole = std::max(0.0, memory.whole - memory.own);
    return memory;
}

}  // namespace livetet
