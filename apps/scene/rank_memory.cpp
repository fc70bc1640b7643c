#include "apps/scene/rank_memory.hpp"

#include <algorithm>
#include <cmath>

#include "solvers/parallel/partition.hpp"

namespace livetet {

namespace {

/// Number of 3x3 blocks in the operator of a P1 mesh: one for each node and two for each edge.
std::size_t block_count(const TetMesh& mesh) {
    std::vector<std::pair<std::int32_t, std::int32_t>> edges;
    edges.reserve(6 * mesh.tets.size());
    for (const Tet& t : mesh.tets)
        for (int i = 0; i < 4; ++i)
            for (int j = i + 1; j < 4; ++j) edges.push_back(std::minmax(t[i], t[j]));
    std::sort(edges.begin(), edges.end());
    const auto unique = std::unique(edges.begin(), edges.end()) - edges.begin();
    return 2 * static_cast<std::size_t>(unique) + mesh.nodes.size();
}

}  // namespace

LevelSize size_of_level(const TetMesh& mesh) {
    const bool linear = mesh.edge_nodes.empty();
    const auto nodes = static_cast<double>(mesh.nodes.size()),
               tets = static_cast<double>(mesh.tets.size());
    const double blocks = linear ? static_cast<double>(block_count(mesh)) : 28.0 * nodes;
    // A block with its column; for each tet its gradients, rotations, nodes and block indices; for
    // each node its vectors, constraints and row of a transfer.
    const double bytes = 76.0 * blocks + (linear ? 228.0 : 470.0) * tets + 600.0 * nodes;
    // For each tet its nodes; for each node its place and its row of the transfer.
    return {mesh.tets.size(), mesh.nodes.size(), bytes,
            (linear ? 16.0 : 40.0) * tets + 72.0 * nodes};
}

RankMemory memory_of_rank(std::span<const LevelSize> levels, int ranks) {
    RankMemory memory{.program = 57e6};
    for (const LevelSize& level : levels) {
        // As partition_levels shares a level out; each part has a layer of nodes around it.
        const auto parts =
            static_cast<double>(std::clamp<std::size_t>(level.tets / min_tets_per_rank, 1, ranks));
        const double layer = parts > 1 ? std::cbrt(parts / static_cast<double>(level.nodes)) : 0;
        memory.own += level.bytes / parts * std::pow(1 + layer, 3);
        memory.whole += level.mesh_bytes;
    }
    // Elements and operators come after the whole mesh has gone.
    if (ranks > 1) memory.whole = std::max(0.0, memory.whole - memory.own);
    return memory;
}

}  // namespace livetet
