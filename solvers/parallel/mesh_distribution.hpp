#pragma once

#include <span>
#include <vector>

#include "mesh/hierarchy_rows.hpp"
#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// This rank's rows of a hierarchy that every rank holds whole.
HierarchyRows rows_of(MPI_Comm comm, const MeshHierarchy& whole);

/// The same of one that the first rank holds, which gives each its rows. `whole` is empty on the
/// others. Collective.
HierarchyRows rows_from_first(MPI_Comm comm, const MeshHierarchy& whole);

/// This rank's share of a mesh of `size` of which each rank has its rows and the parts of its tets
/// (see partition_levels). Throws Error, on every rank, for a tet without a positive volume or a
/// node of no tet, naming `where`. Collective.
PartitionedMesh distribute_rows(MPI_Comm comm, const TetMesh& rows, const MeshSize& size,
                                std::span<const std::int32_t> parts, const std::string& where);

/// The rows of the map of a mesh's nodes for the nodes that this rank owns, from those of its rows
/// of the mesh. Collective.
BarycentricMap own_rows(const PartitionedMesh& share, const BarycentricMap& rows);

}  // namespace livetet
