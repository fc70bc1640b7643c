#pragma once

#include "meshing/levels.hpp"

namespace livetet {

/// Builds a hierarchy below a given mesh. `finest` stays unchanged; the coarser levels are meshed
/// from its boundary as in `build_hierarchy`, each with 1 / coarsening^3 of the tets of the one
/// before, `options.levels` in total. A coarser tet takes the region of the fine tet that contains,
/// or is nearest to, its centre. Levels that could not be made are noted. Throws Error for invalid
/// options.
HierarchyResult levels_below(TetMesh finest, MeshingOptions options,
                             const ProgressCallback& progress = {});

}  // namespace livetet
