#include "apps/scene/scene_image.hpp"

#include <nlohmann/json.hpp>

#include "apps/scene/body_factory.hpp"
#include "apps/scene/mesh_source.hpp"
#include "base/error.hpp"
#include "config/yaml.hpp"
#include "io/hierarchy_file.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// The mesh block that a hierarchy was made from, by its provenance.
MeshSource source_of_hierarchy(const fs::path& path) {
    const auto provenance =
        nlohmann::json::parse(hdf5::File::open(path).read_text("provenance"), nullptr, false);
    const auto request =
        provenance.is_object() ? provenance.value("asked", nlohmann::json()) : nlohmann::json();
    if (!request.is_object() || !request.contains("mesh") || !request["mesh"].is_string())
        fail("{}: does not say what it was meshed from", path.string());
    return read_yaml<MeshSource>(request["mesh"].get<std::string>(), path.string());
}

}  // namespace

fs::path locate(const fs::path& file, const fs::path& named_by) {
    const fs::path folder = named_by.parent_path();
    std::vector<fs::path> candidates{folder / file, folder / file.filename(), file};
    if (file.is_absolute()) candidates = {file, folder / file.filename()};
    for (const fs::path& candidate : candidates) {
        std::error_code ignored;
        if (fs::is_regular_file(candidate, ignored)) return candidate;
    }
    fail("{}: names {}, which is not there, nor beside it", named_by.string(), file.string());
}

std::vector<std::int32_t> select_located(const TetMesh& mesh, SelectionOptions selection,
                                         const std::string& key, const fs::path& named_by) {
    if (selection.mask) selection.mask = locate(*selection.mask, named_by);
    return select_nodes(mesh, selection, key);
}

SceneImage find_scene_image(const Scene& scene, const fs::path& named_in) {
    SceneImage image;
    fs::path named_by = named_in;
    if (!scene.image.empty()) {
        image.file = locate(scene.image, named_by);
        return image;
    }
    MeshSource source = scene.mesh;
    if (kind_of(source.file) == MeshKind::hierarchy) {
        const fs::path hierarchy = locate(source.file, named_by);
        image.grid = read_image_grid(hierarchy);
        source = source_of_hierarchy(hierarchy);
        named_by = hierarchy;
    }
    if (kind_of(source.file) != MeshKind::image)
        fail("{}: names no image, and was meshed from {}, which is none", named_by.string(),
             source.file.string());
    image.file = locate(source.file, named_by);
    image.label_map = source.threshold.empty();
    return image;
}

}  // namespace livetet
