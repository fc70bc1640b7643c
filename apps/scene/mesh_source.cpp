#include "apps/scene/mesh_source.hpp"

#include <Eigen/Geometry>

#include <algorithm>

#include "base/error.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"
#ifdef LIVETET_IMAGES
#include "io/vtu_file.hpp"
#endif

namespace livetet {

namespace {

using Kinds = std::initializer_list<MeshKind>;

constexpr Kinds of_image = {MeshKind::image};
constexpr Kinds of_surface = {MeshKind::surface};
constexpr Kinds without_axes = {MeshKind::surface, MeshKind::tets};
constexpr Kinds meshed = {MeshKind::image, MeshKind::surface};
constexpr Kinds with_levels = {MeshKind::image, MeshKind::surface, MeshKind::tets};

constexpr MeshKey keys[] = {
    {"--cells", "cells", of_image, [](const MeshSource& s) { return s.cells != MeshCells{}; }},
    {"--labels", "labels", of_image, [](const MeshSource& s) { return !s.labels.empty(); }},
    {"--threshold", "threshold", of_image,
     [](const MeshSource& s) { return !s.threshold.empty(); }},
    {"--fill-cavities", "cavities", meshed,
     [](const MeshSource& s) { return s.body.cavities != BodyChoice{}.cavities; }, "fill"},
    {"--all-parts", "parts", meshed,
     [](const MeshSource& s) { return s.body.parts != BodyChoice{}.parts; }, "all"},
    {"--speck-ml", "speck_ml", meshed,
     [](const MeshSource& s) { return s.body.speck_ml.has_value(); }},
    {"--wrap", "wrap_mm", of_surface, [](const MeshSource& s) { return s.wrap_mm.has_value(); }},
    {"--voxel-mm", "voxel_mm", of_image,
     [](const MeshSource& s) { return s.voxel_mm.has_value(); }},
    {"--smoothing-mm", "smoothing_mm", of_image,
     [](const MeshSource& s) { return s.smoothing_mm.has_value(); }},
    {"--metres", "unit", without_axes,
     [](const MeshSource& s) { return s.unit != MeshSource{}.unit; }, "m"},
    {"--space", "space", without_axes,
     [](const MeshSource& s) { return s.space != MeshSource{}.space; }},
    {"--tets", "tets", meshed, [](const MeshSource& s) { return s.tets != MeshSource{}.tets; }},
    {"--levels", "levels", with_levels,
     [](const MeshSource& s) { return s.levels != MeshSource{}.levels; }},
    {"--edge-lengths-mm", "edge_lengths_mm", meshed,
     [](const MeshSource& s) { return !s.edge_lengths_mm.empty(); }},
    {nullptr, "grading", meshed,
     [](const MeshSource& s) { return s.grading != MeshSource{}.grading; }},
    {"--budget-ms", nullptr, meshed, nullptr},
    {"--refine-sphere", nullptr, meshed, nullptr},
    {"--grade-scene", nullptr, meshed, nullptr},
    {"--inside-growth", nullptr, meshed, nullptr},
    {"--min-dihedral-deg", nullptr, meshed, nullptr},
    {"--time-limit-s", nullptr, meshed, nullptr},
    {"--fix-edge-ratio", nullptr, meshed, nullptr},
    {"--again", nullptr, meshed, nullptr},
};

bool holds(Kinds kinds, MeshKind kind) {
    return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

std::string text_of(Kinds kinds) {
    std::string text;
    for (const auto& [kind, name] : {std::pair{MeshKind::image, "an image"},
                                     {MeshKind::surface, "a surface"},
                                     {MeshKind::tets, "tetrahedra (.msh, .vtu, .vtk)"},
                                     {MeshKind::hierarchy, "a hierarchy (.h5)"}})
        if (holds(kinds, kind)) text += fmt::format("{}{}", text.empty() ? "" : " or ", name);
    return text;
}

}  // namespace

bool is_tet_mesh_name(const std::filesystem::path& path) {
    return holds({MeshKind::tets, MeshKind::hierarchy}, kind_of(path));
}

MeshKind kind_of(const std::filesystem::path& file) {
    const std::string end = ending(file);
    if (end == ".h5") return MeshKind::hierarchy;
#ifdef LIVETET_IMAGES
    if (end == ".vtu" || (end == ".vtk" && is_legacy_grid(file))) return MeshKind::tets;
#endif
    if (end == ".msh") return MeshKind::tets;
    if (is_image_name(file)) return MeshKind::image;
#ifdef LIVETET_IMAGES
    if (!is_surface_name(file))
        fail(
            "{}: the name ends in '{}', expected an image (.nii, .nii.gz, .nrrd, .nhdr, .mha, "
            ".mhd; DICOM: .dcm or a folder), a surface (.stl, .obj, .ply, .vtk, .vtp, .off) or a "
            "mesh (.msh, .vtu, .vtk, .h5); 3D Slicer saves other images as one of these",
            file.string(), end);
#endif
    return MeshKind::surface;
}

std::span<const MeshKey> mesh_keys() { return keys; }

void refuse_idle_keys(const std::filesystem::path& file,
                      const std::function<bool(const MeshKey&)>& given,
                      const std::function<std::string(const MeshKey&)>& name) {
    const MeshKind kind = kind_of(file);
    for (const MeshKey& key : keys)
        if (!holds(key.kinds, kind) && given(key))
            fail("{}: is {}, of which {} changes nothing; expected it with {} only", file.string(),
                 text_of({kind}), name(key), text_of(key.kinds));
}

void refuse_keys_of_tets(const MeshSource& source, const std::function<bool(const MeshKey&)>& given,
                         const std::function<std::string(const MeshKey&)>& name) {
    if (source.cells != MeshCells::hexahedra) return;
    constexpr std::string_view of_hexahedra[] = {"--cells",         "--labels",    "--threshold",
                                                 "--fill-cavities", "--all-parts", "--speck-ml",
                                                 "--tets",          "--again"};
    for (const MeshKey& key : keys) {
        const bool is_taken =
            key.option && std::ranges::find(of_hexahedra, key.option) != std::end(of_hexahedra);
        if (!is_taken && given(key))
            fail("{}: {} changes nothing of a grid of hexahedra, expected it with tetrahedra only",
                 source.file.string(), name(key));
    }
}

void check_size(std::span<const Vector3> nodes, const MeshSource& source) {
    constexpr double smallest_m = 1e-3, largest_m = 10;
    Eigen::AlignedBox3d box;
    for (const Vector3& x : nodes) box.extend(x);
    const Vector3 size_mm = 1e3 * box.sizes();
    const double largest = 1e-3 * size_mm.maxCoeff();
    if (largest >= smallest_m && largest <= largest_m) return;
    const bool metres = source.unit == LengthUnit::metre, is_small = largest < smallest_m;
    fail("{}: the body is {:.3g} x {:.3g} x {:.3g} mm large, expected {:.3g} to {:.3g} mm: {}",
         source.file.string(), size_mm.x(), size_mm.y(), size_mm.z(), 1e3 * smallest_m,
         1e3 * largest_m,
         metres && !is_small   ? "is the file in mm, not in metres?"
         : !metres && is_small ? "is the file in metres? --metres (in a scene mesh.unit: m) says so"
                               : "check its unit");
}

void refuse_idle_keys(const MeshSource& source) {
    const auto given = [&](const MeshKey& key) { return key.key && key.given(source); };
    const auto name = [](const MeshKey& key) { return fmt::format("mesh.{}", key.key); };
    refuse_idle_keys(source.file, given, name);
    refuse_keys_of_tets(source, given, name);
    if (source.cells == MeshCells::hexahedra && source.refine > 0)
        fail(
            "mesh.refine: found {} for cells: hexahedra, expected 0; mesh.tets says how many cells",
            source.refine);
}

}  // namespace livetet
