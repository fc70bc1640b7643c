#include "apps/scene/mesh_source.hpp"

#include "base/error.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

constexpr unsigned meshed = image_kind | surface_kind;

constexpr MeshKey keys[] = {
    {"--labels", "labels", image_kind, [](const MeshSource& s) { return !s.labels.empty(); }},
    {"--threshold", "threshold", image_kind,
     [](const MeshSource& s) { return !s.threshold.empty(); }},
    {"--voxel-mm", "voxel_mm", image_kind,
     [](const MeshSource& s) { return s.voxel_mm.has_value(); }},
    {"--smoothing-mm", "smoothing_mm", image_kind,
     [](const MeshSource& s) { return s.smoothing_mm.has_value(); }},
    {"--metres", "unit", surface_kind | tets_kind,
     [](const MeshSource& s) { return s.unit != MeshSource{}.unit; }},
    {"--space", "space", surface_kind | tets_kind,
     [](const MeshSource& s) { return s.space != MeshSource{}.space; }},
    {"--tets", "tets", meshed, [](const MeshSource& s) { return s.tets != MeshSource{}.tets; }},
    {"--levels", "levels", meshed | tets_kind,
     [](const MeshSource& s) { return s.levels != MeshSource{}.levels; }},
    {"--edge-lengths-mm", "edge_lengths_mm", meshed,
     [](const MeshSource& s) { return !s.edge_lengths_mm.empty(); }},
    {"--budget-ms", nullptr, meshed, nullptr},
    {"--refine-sphere", nullptr, meshed, nullptr},
    {"--inside-growth", nullptr, meshed, nullptr},
    {"--min-dihedral-deg", nullptr, meshed, nullptr},
    {"--time-limit-s", nullptr, meshed, nullptr},
    {"--fix-edge-ratio", nullptr, meshed, nullptr},
    {"--again", nullptr, meshed, nullptr},
};

std::string text_of(unsigned kinds) {
    std::string text;
    for (const auto& [kind, name] : {std::pair{image_kind, "an image"},
                                     {surface_kind, "a surface"},
                                     {tets_kind, "a .msh or .vtu"},
                                     {hierarchy_kind, "a hierarchy (.h5)"}})
        if (kinds & kind) text += fmt::format("{}{}", text.empty() ? "" : " or ", name);
    return text;
}

}  // namespace

bool is_tet_mesh_name(const std::filesystem::path& path) {
    return kind_of(path) & (tets_kind | hierarchy_kind);
}

MeshKind kind_of(const std::filesystem::path& file) {
    const std::string end = ending(file);
    if (end == ".h5") return hierarchy_kind;
#ifdef LIVETET_IMAGES
    if (end == ".vtu") return tets_kind;
#endif
    if (end == ".msh") return tets_kind;
    return is_image_name(file) ? image_kind : surface_kind;
}

std::span<const MeshKey> mesh_keys() { return keys; }

void refuse_idle_keys(const std::filesystem::path& file,
                      const std::function<bool(const MeshKey&)>& given,
                      const std::function<std::string(const MeshKey&)>& name) {
    const MeshKind kind = kind_of(file);
    for (const MeshKey& key : keys)
        if (!(key.kinds & kind) && given(key))
            fail("{}: is {}, of which {} changes nothing; expected it with {} only", file.string(),
                 text_of(kind), name(key), text_of(key.kinds));
}

void refuse_idle_keys(const MeshSource& source) {
    refuse_idle_keys(
        source.file, [&](const MeshKey& key) { return key.key && key.given(source); },
        [](const MeshKey& key) { return fmt::format("mesh.{}", key.key); });
}

}  // namespace livetet
