#pragma once

#include "mesh/barycentric_map.hpp"
#include "solvers/parallel/local_sets.hpp"
#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// A rank's share of a mesh that is made from a coarser one, each rank from its own share of that:
/// nodes, tets and sets have the numbers that with_refined_levels and quadratic_mesh give those of
/// the whole mesh. Inherited nodes stay with their ranks, a midpoint belongs to the rank of its
/// edge's lower end.
struct FinerShare {
    PartitionedMesh share;
    /// Places the rank's own nodes among the local nodes of the coarse share. The first of each
    /// row is an own one.
    BarycentricMap in_coarse;
    LocalSets sets;
};

/// Each tet is cut into eight (see with_refined_levels). `coarse`: of four-node tets on several
/// ranks, as `sets`. Throws Error where the whole mesh has more tets or nodes than there are
/// numbers. Collective.
FinerShare refined_share(const PartitionedMesh& coarse, const LocalSets& sets);

/// With ten-node tets (see quadratic_mesh). As above.
FinerShare quadratic_share(const PartitionedMesh& linear, const LocalSets& sets);

}  // namespace livetet
