#pragma once

#include <string>
#include <vector>

#include "mesh/barycentric_map.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Non-nested levels of one body, the finest first, each meshed on its own. `transfers[l]` gives
/// every node of level l its place in level l + 1: levels.size() - 1 of them.
struct MeshHierarchy {
    std::vector<TetMesh> levels;
    std::vector<BarycentricMap> transfers;
    std::string provenance;  ///< how it was made: input, options, versions
    /// Empty, or for each transfer: of every tet of level l the one of level l + 1 that it was cut
    /// from; empty where the two were meshed each on its own.
    std::vector<std::vector<std::int32_t>> parents{};

    /// Whether level `l` was cut from the next one.
    bool is_cut(std::size_t l) const { return l < parents.size() && !parents[l].empty(); }
};

/// A hierarchy of these levels (finest first), with its transfers built.
MeshHierarchy make_hierarchy(std::vector<TetMesh> levels, std::string provenance);

}  // namespace livetet
