#pragma once

#include <string>
#include <vector>

#include "base/progress.hpp"
#include "mesh/hierarchy.hpp"
#include "meshing/gmsh_volume.hpp"
#include "meshing/options.hpp"
#include "meshing/quality.hpp"
#include "meshing/remesh.hpp"

namespace livetet {

/// How one level came to be.
struct LevelReport {
    double asked_edge_length_m = 0;  ///< the options', or the one found for the number of tets asked for
    RemeshReport remesh;
    MeshQuality quality;
    int fillings = 0;    ///< volumes meshed on the way to the number of tets asked for
    double seconds = 0;  ///< wall time
};

struct HierarchyResult {
    MeshHierarchy hierarchy;
    std::vector<LevelReport> levels;  ///< one each
    std::vector<std::string> notes;   ///< what came out otherwise than asked: a line each, for the user
};

/// A hierarchy of non-nested levels: the surface is repaired, then for every level remeshed at that level's own edge
/// length and filled on its own. The finest level's edge length is found from `options.target_tets` where no lengths
/// are given (tets = c V / h^3, c from the last try). A level that would not be coarser than the one before it is left
/// out, with a note. `gmsh` lets tests replace how Gmsh is run; its time limit and passes come from `options`. Throws
/// Error as repair_surface, remesh_surface and fill_surface do.
HierarchyResult build_hierarchy(const TriangleMesh& surface, const MeshingOptions& options,
                                const ProgressCallback& progress = {}, const GmshOptions& gmsh = {});

}  // namespace livetet
