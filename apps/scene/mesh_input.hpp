#pragma once

#include "apps/scene/mesh_source.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"

namespace livetet {

/// A material of a label map: what its voxels fill, and what the finest level's tets of that region
/// do.
struct RegionVolume {
    std::int32_t label = 0;
    double voxels_m3 = 0, tets_m3 = 0;
};

/// A hierarchy and how it came to be.
struct MeshedInput {
    HierarchyResult result;
    std::optional<ImageSurface> image;  ///< where it was an image
    std::optional<ImageGrid> grid;      ///< of that image
    std::vector<RegionVolume>
        regions;  ///< of a label map's finest level, of what of it is in the body
};

/// Meshes an image (a label map, or a grey one between thresholds: then all of one region) or a
/// surface. Labels, levels, tets and edge lengths come from `source`, the rest from `options`;
/// refined levels, if `source` asks for them, are in the hierarchy, not in the reports. Throws
/// Error, naming --threshold, where a label map was expected and the image is grey; where `source`
/// says what is not for such a file; MeshingFailure where no tries gave a mesh.
MeshedInput mesh_input(const MeshSource& source, const ProgressCallback& progress,
                       MeshingOptions options = {});

/// Throws the failure as an Error of one line, after writing its surface to `look` (.stl) where
/// that is not the `input`.
[[noreturn]] void fail_with_surface(const MeshingFailure& failure,
                                    const std::filesystem::path& look,
                                    const std::filesystem::path& input);

}  // namespace livetet
