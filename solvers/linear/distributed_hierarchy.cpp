#include "solvers/linear/distributed_hierarchy.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "mesh/refine.hpp"
#include "solvers/linear/transfer.hpp"

namespace livetet {

namespace {

int rank_count(MPI_Comm comm) {
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    return ranks;
}

void check_parts(int ranks, const std::vector<TetMesh>& levels,
                 std::span<const std::vector<std::int32_t>> all_parts) {
    if (ranks == 1) return;
    if (all_parts.size() != levels.size())
        fail(
            "mesh hierarchy: found parts of {} levels on {} ranks, expected those of {} levels "
            "(see partition_levels)",
            all_parts.size(), ranks, levels.size());
    for (std::size_t l = 0; l < levels.size(); ++l) {
        const std::vector<std::int32_t>& parts = all_parts[l];
        if (parts.size() != levels[l].tets.size())
            fail("mesh hierarchy: found parts of {} tets in level {}, expected {}", parts.size(), l,
                 levels[l].tets.size());
        const auto [low, high] = std::minmax_element(parts.begin(), parts.end());
        if (*low < 0 || *high >= ranks)
            fail("mesh hierarchy: found parts {} to {} in level {}, expected 0 to {}", *low, *high,
                 l, ranks - 1);
    }
}

}  // namespace

DistributedHierarchy::DistributedHierarchy(MPI_Comm comm, const MeshHierarchy& hierarchy,
                                           std::span<const std::vector<std::int32_t>> parts)
    : comm(comm) {
    PetscBool runs = PETSC_FALSE;
    LIVETET_PETSC(PetscInitialized(&runs));
    if (!runs)
        fail("a DeformableBody needs PETSc: found no PetscSession, expected one made before");
    check_hierarchy(hierarchy);
    check_parts(rank_count(comm), hierarchy.levels, parts);
    take(hierarchy, parts);
}

DistributedHierarchy DistributedHierarchy::of_grid(MPI_Comm comm, const MeshHierarchy& levels) {
    DistributedHierarchy grid(comm);
    grid.take(levels, {});
    return grid;
}

void DistributedHierarchy::take(const MeshHierarchy& hierarchy,
                                std::span<const std::vector<std::int32_t>> parts) {
    if (rank_count(comm) == 1) whole = &hierarchy;
    tets = hierarchy.levels.front().tets.size();
    std::vector<double> of_nodes;  // volume at each node of the level before, m^3
    for (std::size_t l = 0; l < hierarchy.levels.size(); ++l) {
        const TetMesh& mesh = hierarchy.levels[l];
        std::vector<double> volumes;  // of the tets; of the finest level their own
        if (mesh.hexahedra.empty()) {
            if (l > 0) volumes = carried_volumes(of_nodes, hierarchy.transfers[l - 1], mesh);
            if (l + 1 < hierarchy.levels.size())
                of_nodes = l == 0 ? nodal_volumes(mesh) : nodal_volumes(mesh, volumes);
        }
        Level& level = levels.emplace_back();
        const HeapMeter meter(&level.cost);
        level.share =
            distribute_mesh(comm, mesh, parts.empty() ? std::span<const std::int32_t>{} : parts[l]);
        if (!volumes.empty())
            for (const std::int32_t e : level.share.tet_ids)
                level.share.volumes.push_back(volumes[e]);
    }
    const PartitionedMesh& finest = levels.front().share;
    pieces = of_own_nodes(level_pieces(hierarchy.levels.front()), finest);
    if (finest.ranks > 1) sets = local_sets(hierarchy.levels.front(), finest);
    const HeapMeter meter(&cost_of_between);
    for (std::size_t l = 0; l + 1 < levels.size(); ++l) {
        const PartitionedMesh& share = levels[l + 1].share;
        LevelPieces coarse = level_pieces(hierarchy.levels[l + 1]);
        std::vector<std::int32_t> wholes =
            pieces_joined_by(hierarchy.levels[l], coarse, hierarchy.transfers[l]);
        between.push_back(
            {TransferRows(levels[l].share, share, hierarchy.transfers[l]),
             CoarseBody(of_own_nodes(std::move(coarse), share), std::move(wholes), share)});
    }
}

void DistributedHierarchy::add_refined() {
    check_can_refine(tets);
    add(refined_share, 8);
}

void DistributedHierarchy::add_quadratic() { add(quadratic_share, 1); }

void DistributedHierarchy::add(FinerShare (*finer_of)(const PartitionedMesh&, const LocalSets&),
                               int tets_of_one) {
    const PartitionedMesh& coarse = levels.front().share;
    if (coarse.is_quadratic())
        fail("refine: the finest level has ten-node tets, expected four-node ones");
    Level level;
    BarycentricMap in_coarse;
    {
        const HeapMeter meter(&level.cost);
        FinerShare finer = finer_of(coarse, sets);
        level.share = std::move(finer.share);
        in_coarse = std::move(finer.in_coarse);
        sets = std::move(finer.sets);
    }
    const HeapMeter meter(&cost_of_between);
    LevelPieces of_finer = pieces_of_finer(pieces, level.share, in_coarse, tets_of_one);
    between.insert(between.begin(), Between{TransferRows(coarse, std::move(in_coarse)),
                                            CoarseBody(std::move(pieces), {}, coarse)});
    pieces = std::move(of_finer);
    tets *= static_cast<std::size_t>(tets_of_one);
    levels.insert(levels.begin(), std::move(level));
}

void DistributedHierarchy::drop_coarser() {
    levels.erase(levels.begin() + 1, levels.end());
    between.clear();
}

}  // namespace livetet
