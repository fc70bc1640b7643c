#include "apps/scene/scene_image.hpp"

#include <nlohmann/json.hpp>

#include "apps/scene/mesh_source.hpp"
#include "apps/scene/node_selection.hpp"
#include "base/error.hpp"
#include "config/yaml.hpp"
#include "io/dicom_name.hpp"
#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"

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

/// The file that `named_by` names: relative to its folder, beside it, or as named.
std::optional<fs::path> find_beside(const fs::path& file, const fs::path& named_by) {
    const fs::path folder = named_by.parent_path(), name = image_filename(file);
    std::vector<fs::path> candidates{folder / file, folder / name, file};
    if (file.is_absolute()) candidates = {file, folder / name};
    for (const fs::path& candidate : candidates) {
        std::error_code ignored;
        if (!name.empty() && fs::exists(image_place(candidate), ignored) &&
            (is_image_name(candidate) || fs::is_regular_file(candidate, ignored)))
            return candidate;
    }
    return {};
}

/// Whether a name is that of a surface or mesh. Other names may be those of DICOM files or folders
/// that are not there.
bool names_no_image(const fs::path& file) {
    try {
        return kind_of(file) != MeshKind::image;
    } catch (const Error&) {
        return false;
    }
}

}  // namespace

fs::path locate(const fs::path& file, const fs::path& named_by) {
    if (const auto found = find_beside(file, named_by)) return *found;
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
    if (ending(source.file) == ".h5") {
        const fs::path hierarchy = locate(source.file, named_by);
        image.grid = read_image_grid(hierarchy);
        source = source_of_hierarchy(hierarchy);
        named_by = hierarchy;
    }
    const std::optional<fs::path> found = find_beside(source.file, named_by);
    if (names_no_image(found.value_or(source.file)))
        fail("{}: names no image, and was meshed from {}, which is none", named_by.string(),
             source.file.string());
    image.file = found ? *found : locate(source.file, named_by);
    image.label_map = source.threshold.empty();
    return image;
}

}  // namespace livetet
