#pragma once

#include <span>
#include <vector>

#include "mesh/hierarchy_rows.hpp"
#include "solvers/assembly/phase_timer.hpp"
#include "solvers/linear/coarse_body.hpp"
#include "solvers/linear/transfer_rows.hpp"
#include "solvers/parallel/finer_share.hpp"
#include "solvers/parallel/level_pieces.hpp"
#include "solvers/parallel/local_sets.hpp"

namespace livetet {

/// A body's mesh hierarchy, taken apart for the ranks that share it: what its solvers are made of.
/// On several ranks nothing here is of the size of the whole mesh; what it is made from may be
/// freed.
struct DistributedHierarchy {
    /// On one rank, where the hierarchy must outlive the solver, so it cannot be a temporary; on
    /// several if each holds it and `parts`, the part of each tet of each level (see
    /// partition_levels). Throws Error where PETSc does not run, for a hierarchy that
    /// check_hierarchy rejects, and for parts that do not fit it. Collective.
    DistributedHierarchy(MPI_Comm comm, const MeshHierarchy& hierarchy,
                         std::span<const std::vector<std::int32_t>> parts = {});
    /// On several ranks, each of which has its rows of the hierarchy and the parts of its tets. No
    /// rank holds more of a level than its rows and its part. Throws Error, on every rank, for
    /// parts that do not fit the rows, levels that are not the finest first, a tet without a
    /// positive volume, a node of no tet, and sets that local_sets rejects. Numbers of nodes in
    /// tets and transfers are not checked (see read_hierarchy_rows). Collective.
    DistributedHierarchy(MPI_Comm comm, const HierarchyRows& hierarchy,
                         std::span<const std::vector<std::int32_t>> parts);
    /// Puts a level before the finest one, of which each rank cuts its own part (refined_share), or
    /// which has ten nodes a tet where that one has four (quadratic_share). On several ranks; on
    /// one, with_refined_levels and with_quadratic_level do it before. Collective.
    void add_refined();
    void add_quadratic();
    /// Leaves the finest level alone.
    void drop_coarser();
    DistributedHierarchy(MPI_Comm, const MeshHierarchy&&,
                         std::span<const std::vector<std::int32_t>> = {}) = delete;
    /// Of the levels of a grid (see grid_hierarchy), on one rank; they are not checked.
    static DistributedHierarchy of_grid(MPI_Comm comm, const MeshHierarchy& levels);

    struct Level {
        PartitionedMesh share;
        PhaseCost cost{};
    };
    /// What is between a level and the next coarser one.
    struct Between {
        TransferRows rows;
        CoarseBody coarse;
    };

    MPI_Comm comm;
    const MeshHierarchy* whole = nullptr;  ///< on one rank; else null
    std::size_t tets = 0;                  ///< of the whole finest mesh
    std::vector<Level> levels{};           ///< finest first
    std::vector<Between> between{};        ///< by the finer level
    LevelPieces pieces{};                  ///< of the finest level's own nodes
    LocalSets sets{};                      ///< of the finest level, on several ranks
    PhaseCost cost_of_between{};

  private:
    explicit DistributedHierarchy(MPI_Comm comm) : comm(comm) {}
    void take_whole(const MeshHierarchy& hierarchy);
    void take_rows(const HierarchyRows& hierarchy,
                   std::span<const std::vector<std::int32_t>> parts);
    void connect(std::vector<LevelPieces> of_levels, std::span<const BarycentricMap> transfers);
    void add(FinerShare (*finer_of)(const PartitionedMesh&, const LocalSets&), int tets_of_one);
};

}  // namespace livetet
