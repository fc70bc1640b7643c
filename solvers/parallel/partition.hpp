#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/petsc.hpp"
#include "mesh/hierarchy_rows.hpp"
#include "solvers/parallel/partitioner.hpp"

namespace livetet {

/// For each tet the number of its part, 0 to parts - 1: parts of about equal size that share few
/// faces (G. Karypis and V. Kumar, A fast and high quality multilevel scheme, 1998, as METIS has
/// it: the dual graph, neighbours share three nodes). The same answer every time. Throws Error if
/// parts < 1 or there are fewer tets than parts; std::runtime_error where METIS fails.
std::vector<std::int32_t> partition_tets(std::span<const Tet> tets, int parts);

/// The same by PTScotch (C. Chevalier and F. Pellegrini, PT-Scotch, 2008) for the tets of this
/// rank's rows of a mesh of `whole` (see HierarchyRows). On another number of ranks the answer may
/// be another. Throws Error where PETSc has 64-bit indices. Collective.
std::vector<std::int32_t> partition_tets_in_parallel(MPI_Comm comm, std::span<const Tet> rows,
                                                     const MeshSize& whole, int parts);

/// Minimum number of tets of a level for each rank that shares it: a coarse level on all ranks
/// would cost more in messages than it saves in work.
constexpr std::size_t min_tets_per_rank = 200;

/// Owner of each node of this rank's rows of a mesh: the part of most tets at it, of several the
/// lowest; of an edge node that of its edge's lower end. `rows`, `parts`: of this rank's tets.
/// Throws Error, on every rank, for a node that is of no tet, naming `where`. Collective.
std::vector<std::int32_t> node_owners(MPI_Comm comm, const TetMesh& rows, const MeshSize& whole,
                                      std::span<const std::int32_t> parts,
                                      const std::string& where);

/// A part of every tet of this rank's rows of every level. The finest level is partitioned or,
/// where it was cut from a coarser one that has tets for as many ranks, that one: tets take the
/// parts of those that they were cut from. Each coarser level is cut where the level above it is:
/// its tets belong to the rank that owns the nearest fine nodes, so that nearly all of a transfer's
/// entries are on the rank of their row. METIS has the tets of the partitioned level on the first
/// rank; nothing else is of the size of a whole mesh. Collective.
std::vector<std::vector<std::int32_t>> partition_levels(MPI_Comm comm,
                                                        const HierarchyRows& hierarchy,
                                                        Partitioner partitioner);

/// The same for all tets of a hierarchy that every rank holds whole. Collective.
std::vector<std::vector<std::int32_t>> partition_levels(MPI_Comm comm,
                                                        const MeshHierarchy& hierarchy,
                                                        Partitioner partitioner);

}  // namespace livetet
