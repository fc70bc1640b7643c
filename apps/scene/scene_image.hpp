#pragma once

#include <optional>

#include "apps/scene/scene.hpp"
#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Finds a file that another file names: beside that file, else under its own path. Results are
/// moved together with their inputs, and a relative path is not relative to the working folder.
/// Throws Error if it is found in neither place.
std::filesystem::path locate(const std::filesystem::path& file,
                             const std::filesystem::path& named_by);

/// `select_nodes` with a mask found by `locate`.
std::vector<std::int32_t> select_located(const TetMesh& mesh, SelectionOptions selection,
                                         const std::string& key,
                                         const std::filesystem::path& named_by);

/// The image of a scene.
struct SceneImage {
    std::filesystem::path file;
    std::optional<bool> label_map;  ///< of the meshed image; empty: unknown
    std::optional<ImageGrid> grid;  ///< its voxel grid when it was meshed, if known
};

/// Finds the image that the scene names; else the one from which its mesh, or the hierarchy that it
/// names, was made. A file that has gone is looked for by name beside `named_in` and beside the
/// hierarchy. `named_in`: the scene file, or the result that holds the scene. Throws Error naming
/// what is missing.
SceneImage find_scene_image(const Scene& scene, const std::filesystem::path& named_in);

}  // namespace livetet
