#include "solvers/linear/distributed_hierarchy.hpp"

#include <algorithm>

#include "base/error.hpp"
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
    const HeapMeter meter(&cost_of_between);
    for (std::size_t l = 0; l + 1 < levels.size(); ++l)
        between.push_back(
            {TransferRows(levels[l].share, levels[l + 1].share, hierarchy.transfers[l]),
             CoarseBody(hierarchy.levels[l + 1], hierarchy.levels[l], hierarchy.transfers[l],
                        levels[l + 1].share)});
}

}  // namespace livetet
