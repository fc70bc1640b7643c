#pragma once

#include "apps/scene.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"

namespace livetet {

/// A hierarchy and how it came to be.
struct MeshedInput {
    HierarchyResult result;
    std::optional<ImageSurface> image;  ///< where it was an image
};

/// Meshes an image (a label map, or a grey one between thresholds: then all of one region) or a surface. Throws Error,
/// naming --threshold, where a label map was expected and the image is grey.
MeshedInput mesh_input(const MeshSource& source, const ProgressCallback& progress);

}  // namespace livetet
