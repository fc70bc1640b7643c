#pragma once

#include "apps/scene/mesh_grading.hpp"
#include "apps/scene/mesh_source.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"
#include "meshing/voxel_grid.hpp"

namespace livetet {

/// Volumes of a label: of its voxels, and of the finest level's tets of that region.
struct RegionVolume {
    std::int32_t label = 0;
    double voxels_m3 = 0, tets_m3 = 0;
};

/// A hierarchy and a report of its making.
struct MeshedInput {
    HierarchyResult result;
    std::optional<ImageSurface> image;  ///< if the input was an image
    std::optional<ImageGrid> grid;      ///< of that image
    std::vector<RegionVolume>
        regions;  ///< of the finest level of a label map, for labels within the body
};

/// Meshes an image (a label map, or a grey image between thresholds, as one region) or a surface.
/// Labels, levels, tets and edge lengths come from `source`, the rest from `options`. Levels
/// refined on request of `source` are in the hierarchy, not in the reports. `grading`: patches with
/// shorter edges.
///
/// Throws Error if one of those is off the body, or if `source` has keys that do not apply to the
/// file. Throws Error, naming --threshold, for a grey image where a label map was expected. Throws
/// MeshingFailure if no attempt gave a mesh.
MeshedInput mesh_input(const MeshSource& source, const ProgressCallback& progress,
                       MeshingOptions options = {}, const SceneGrading& grading = {});

/// A grid of hexahedra from an image.
struct GridInput {
    MeshHierarchy hierarchy;
    ImageGrid image;
    VoxelGrid grid;  ///< without its mesh
    std::vector<std::string> notes;
};

/// The grid that `source` (cells: hexahedra) asks for. Throws Error as `mesh_input` does.
GridInput grid_input(const MeshSource& source);

/// Rethrows the failure as an Error of one line. Writes the failed surface to `look` (.stl) first,
/// unless that is the `input`.
[[noreturn]] void fail_with_surface(const MeshingFailure& failure,
                                    const std::filesystem::path& look,
                                    const std::filesystem::path& input);

}  // namespace livetet
