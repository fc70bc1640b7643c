#pragma once

#include "apps/scene.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"

namespace livetet {

/// A material of a label map: what its voxels fill, and what the finest level's tets of that region do.
struct RegionVolume {
    std::int32_t label = 0;
    double voxels_m3 = 0, tets_m3 = 0;
};

/// A hierarchy and how it came to be.
struct MeshedInput {
    HierarchyResult result;
    std::optional<ImageSurface> image;  ///< where it was an image
    std::vector<RegionVolume> regions;  ///< of a label map's finest level, of what of it is in the body
};

/// Meshes an image (a label map, or a grey one between thresholds: then all of one region) or a surface. Labels, levels,
/// tets and edge lengths come from `source`, the rest from `options`. Throws Error, naming --threshold, where a label map
/// was expected and the image is grey; MeshingFailure where no tries gave a mesh.
MeshedInput mesh_input(const MeshSource& source, const ProgressCallback& progress, MeshingOptions options = {});

}  // namespace livetet
