#pragma once

#include "meshing/levels.hpp"

namespace livetet {

/// A hierarchy of tets that others made: `finest` as it is, and under it levels meshed from its
/// boundary as `build_hierarchy` does, each with 1 / coarsening^3 of the tets of the one before,
/// `options.levels` in all. A coarser tet is of the region that its centre lies in, or is nearest
/// to. What could not be made is a note. Throws Error where the options cannot be used.
HierarchyResult levels_below(TetMesh finest, MeshingOptions options,
                             const ProgressCallback& progress = {});

}  // namespace livetet
