#include "solvers/linear/distributed_hierarchy.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/together.hpp"
#include "mesh/refine.hpp"
#include "solvers/linear/transfer.hpp"
#include "solvers/parallel/mesh_distribution.hpp"

namespace livetet {

namespace {

int rank_count(MPI_Comm comm) {
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    return ranks;
}

void check_petsc_runs() {
    PetscBool runs = PETSC_FALSE;
    LIVETET_PETSC(PetscInitialized(&runs));
    if (!runs)
        fail("a DeformableBody needs PETSc: found no PetscSession, expected one made before");
}

void check_parts(int ranks, const std::vector<TetMesh>& levels,
                 std::span<const std::vector<std::int32_t>> all_parts) {
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
        if (parts.empty()) continue;  // a rank without rows
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
    check_petsc_runs();
    check_hierarchy(hierarchy);
    const int ranks = rank_count(comm);
    if (ranks == 1) {
        take_whole(hierarchy);
        return;
    }
    check_parts(ranks, hierarchy.levels, parts);
    int rank = 0;
    MPI_Comm_rank(comm, &rank);
    std::vector<std::vector<std::int32_t>> of_rows;
    for (const std::vector<std::int32_t>& of_level : parts)
        of_rows.push_back(rows_of_table(std::span(of_level), static_cast<std::size_t>(rank),
                                        static_cast<std::size_t>(ranks)));
    take_rows(rows_of(comm, hierarchy), of_rows);
}

DistributedHierarchy::DistributedHierarchy(MPI_Comm comm, const HierarchyRows& hierarchy,
                                           std::span<const std::vector<std::int32_t>> parts)
    : comm(comm) {
    check_petsc_runs();
    const int ranks = rank_count(comm);
    if (ranks == 1) fail("mesh hierarchy: found rows of one rank, expected several");
    together(comm, [&] { check_parts(ranks, hierarchy.rows.levels, parts); });
    take_rows(hierarchy, parts);
}

DistributedHierarchy DistributedHierarchy::of_grid(MPI_Comm comm, const MeshHierarchy& levels) {
    DistributedHierarchy grid(comm);
    grid.take_whole(levels);
    return grid;
}

void DistributedHierarchy::take_whole(const MeshHierarchy& hierarchy) {
    whole = &hierarchy;
    tets = hierarchy.levels.front().tets.size();
    std::vector<LevelPieces> of_levels;
    for (const TetMesh& mesh : hierarchy.levels) {
        Level& level = levels.emplace_back();
        const HeapMeter meter(&level.cost);
        level.share = distribute_mesh(comm, mesh, {});
        of_levels.push_back(level_pieces(mesh));
    }
    connect(std::move(of_levels), hierarchy.transfers);
}

void DistributedHierarchy::take_rows(const HierarchyRows& hierarchy,
                                     std::span<const std::vector<std::int32_t>> parts) {
    const MeshHierarchy& rows = hierarchy.rows;
    tets = hierarchy.sizes.front().tets;
    std::vector<LevelPieces> of_levels;
    for (std::size_t l = 0; l < rows.levels.size(); ++l) {
        if (l > 0) check_finer(hierarchy.sizes[l - 1].tets, hierarchy.sizes[l].tets, l);
        Level& level = levels.emplace_back();
        const HeapMeter meter(&level.cost);
        level.share = distribute_rows(comm, rows.levels[l], hierarchy.sizes[l], parts[l],
                                      fmt::format("mesh hierarchy, level {}", l));
        of_levels.push_back(level_pieces(level.share));
    }
    sets = local_sets(rows.levels.front(), levels.front().share);
    std::vector<BarycentricMap> transfers;
    for (std::size_t l = 0; l < rows.transfers.size(); ++l)
        transfers.push_back(own_rows(levels[l].share, rows.transfers[l]));
    connect(std::move(of_levels), transfers);
}

/// Transfers and volumes between levels. `transfers`: of each rank's own nodes.
void DistributedHierarchy::connect(std::vector<LevelPieces> of_levels,
                                   std::span<const BarycentricMap> transfers) {
    const HeapMeter meter(&cost_of_between);
    for (std::size_t l = 0; l + 1 < levels.size(); ++l) {
        const PartitionedMesh& fine = levels[l].share;
        PartitionedMesh& coarse = levels[l + 1].share;
        TransferRows rows(coarse, transfers[l]);
        if (coarse.hexahedra.empty())
            coarse.volumes = carried_volumes(nodal_volumes(fine), rows, coarse);
        std::vector<std::int32_t> wholes =
            pieces_joined_by(comm, of_levels[l], of_levels[l + 1], rows);
        between.push_back(
            {std::move(rows), CoarseBody(of_levels[l + 1], std::move(wholes), coarse)});
    }
    pieces = std::move(of_levels.front());
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
    between.insert(between.begin(), Between{TransferRows::of_local(coarse, std::move(in_coarse)),
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
