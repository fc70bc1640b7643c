#pragma once

#include "apps/scene.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"

namespace livetet {

/// A hierarchy and how it came to be.
struct MeshedInput {
    HierarchyResult result;
    std::optional<ImageSurface> image;  ///< where it was a label map
};

/// Meshes a label map (.nii, .nii.gz) or a surface (.stl, .obj, .ply, .vtk, .off).
MeshedInput mesh_input(const MeshSource& source, const ProgressCallback& progress);

}  // namespace livetet
