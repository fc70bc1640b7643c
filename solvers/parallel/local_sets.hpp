#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// The named sets of a mesh, as far as a rank has their nodes, in its local ones: node sets sorted,
/// triangles those with a node that the rank owns. All ranks have all names.
struct LocalSets {
    std::map<std::string, std::vector<std::int32_t>> nodes;
    std::map<std::string, std::vector<Triangle>> triangles;
};

/// Those of a mesh of which each rank has its rows (see HierarchyRows). Throws Error, on every rank
/// alike, if a set names a node that there is not, or has a triangle that is no face of the mesh:
/// no rank would be sure to have its edges. Collective.
LocalSets local_sets(const TetMesh& rows, const PartitionedMesh& share);

}  // namespace livetet
