#pragma once

#include <optional>

#include "apps/scene/scene.hpp"
#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The file of this name beside the file that names it, or where it is said to be: results are
/// moved with what they were made from, and a relative name is not one of wherever one stands.
/// Throws Error where there is neither.
std::filesystem::path locate(const std::filesystem::path& file,
                             const std::filesystem::path& named_by);

/// `select_nodes` where a mask is one that `locate` finds.
std::vector<std::int32_t> select_located(const TetMesh& mesh, SelectionOptions selection,
                                         const std::string& key,
                                         const std::filesystem::path& named_by);

/// The image that a scene is about.
struct SceneImage {
    std::filesystem::path file;
    std::optional<bool> label_map;  ///< of the image that was meshed; else nobody knows
    std::optional<ImageGrid>
        grid;  ///< where its voxels lay when it was meshed, where that is known
};

/// The image that the scene names; else the one that its mesh was made from, or the hierarchy was
/// that it names. Where a file is no longer there, one of its name beside `told_by`, or beside the
/// hierarchy, is meant. `told_by`: the scene's file, or the result that holds the scene. Throws
/// Error that says what is missing where there is none.
SceneImage find_scene_image(const Scene& scene, const std::filesystem::path& told_by);

}  // namespace livetet
