#pragma once

#include <string>
#include <vector>

#include "mesh/barycentric_map.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Hierarchy of meshes of one body, the finest level first. `transfers[l]` maps every node of level
/// l into level l + 1; there are levels.size() - 1 transfers. Levels are meshed independently
/// (non-nested) or refined from the next one.
struct MeshHierarchy {
    std::vector<TetMesh> levels;
    std::vector<BarycentricMap> transfers;
    std::string provenance;  ///< how it was made: input, options, versions
    /// Parent tets of refined levels: for every tet of level l the tet of level l + 1 that contains
    /// it. An entry is empty if the two levels were meshed independently; the whole vector may be
    /// empty.
    std::vector<std::vector<std::int32_t>> parents{};

    /// Whether level `l` is a refinement of the next one.
    bool is_cut(std::size_t l) const { return l < parents.size() && !parents[l].empty(); }
};

/// Throws Error if a hierarchy has no levels, a level that check_tet_mesh rejects, a level with
/// more tets than the one before it, or transfers that do not fit its levels.
void check_hierarchy(const MeshHierarchy& hierarchy);

/// Throws Error if level `coarser` has more tets than the one before it.
void check_finer(std::size_t tets, std::size_t coarser_tets, std::size_t coarser);

/// Builds a hierarchy from levels (finest first) and computes its transfers. Throws Error as
/// check_hierarchy does.
MeshHierarchy make_hierarchy(std::vector<TetMesh> levels, std::string provenance);

}  // namespace livetet
