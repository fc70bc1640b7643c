#include "apps/scene/mesh_input.hpp"

#include <fmt/ranges.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "base/file.hpp"
#include "image/label_map.hpp"
#include "io/dicom_name.hpp"
#include "io/image_file.hpp"
#include "io/surface_file.hpp"
#include "mesh/refine.hpp"
#include "meshing/interfaces.hpp"

namespace livetet {

namespace {

/// Adds notes on picked voxels apart from the body: by label, or for a threshold as a whole.
void note_what_lies_apart(MeshedInput& meshed, double voxel_m3, const MeshSource& source) {
    for (const auto& [label, count] : meshed.image->left_out) {
        const auto in_body = meshed.image->label_voxels.find(label);
        const std::int64_t all =
            count + (in_body == meshed.image->label_voxels.end() ? 0 : in_body->second);
        meshed.result.notes.push_back(fmt::format(
            "{}: {:.4g} of its {:.4g} ml do not hang together with the largest part and are left "
            "out; --all-parts (in a scene mesh.parts: all) meshes them too",
            source.threshold.empty() ? fmt::format("label {}", label)
                                     : fmt::format("threshold {}", source.threshold),
            1e6 * voxel_m3 * static_cast<double>(count),
            1e6 * voxel_m3 * static_cast<double>(all)));
    }
}

constexpr const char* advice =
    "a grey image is meshed between thresholds: --threshold LOW:HIGH (in a scene mesh.threshold)";

/// Reads a label map. If no labels were picked, refuses one that looks like a grey image. Notes the
/// names of a segmentation's labels.
LabelImage labels_of(const MeshSource& source, std::vector<std::string>& notes) {
    LabelImage image;
    const Volume volume = read_volume(source.file);
    try {
        image = label_image(volume, source.file);
    } catch (const NotALabel& e) {
        fail("{}; {}", e.what(), advice);
    }
    for (const auto& [label, name] : volume.label_names)
        notes.push_back(fmt::format("label {} is the segment \"{}\"", label, name));
    if (!source.labels.empty()) return image;
    if (const std::string why = why_no_label_map(image); !why.empty())
        fail(
            "{}: looks like a grey image ({}), expected labels; {}, a label map's labels are "
            "picked by --labels",
            source.file.string(), why, advice);
    return image;
}

/// A mask: 1 in the voxels whose grey values lie in the requested range.
/// Notes voxels without a value.
LabelImage between_thresholds(const MeshSource& source, std::vector<std::string>& notes) {
    const std::string where = source.file.string();
    if (!source.labels.empty())
        fail("{}: both labels and threshold ({}) are given, expected one of them", where,
             source.threshold);
    const auto [low, high] = range_of(source.threshold).value();
    const GreyImage grey = grey_image_with_gaps(read_volume(source.file), source.file);
    LabelImage image{grey.size, grey.ras_from_voxel, std::vector<std::int32_t>(grey.values.size())};
    std::int64_t gaps = 0, inside = 0;
    float min = std::numeric_limits<float>::max(), max = -min;
    for (std::size_t n = 0; n < grey.values.size(); ++n) {
        const float v = grey.values[n];
        if (!std::isfinite(v)) {
            ++gaps;
            continue;
        }
        min = std::min(min, v);
        max = std::max(max, v);
        inside += image.values[n] = v >= low && v <= high;
    }
    if (inside == 0)
        fail("{}: no voxel is within the threshold {}, its values are {} to {}", where,
             source.threshold, min, max);
    if (gaps > 0)
        notes.push_back(
            fmt::format("threshold {}: {} of {} voxels are not finite (NaN) and count as outside",
                        source.threshold, gaps, grey.values.size()));
    return image;
}

/// `grading` must outlive the options.
void take_keys(const MeshSource& source, const SceneGrading& grading, MeshingOptions& options) {
    if (!grading.patches.empty()) {
        options.grading.patches = grading.surface_patches();
        options.check_surface = [&grading, before = options.check_surface](const TriangleMesh& s) {
            if (before) before(s);
            grading.check(s);
        };
    }
    options.labels.assign(source.labels.begin(), source.labels.end());
    options.body = source.body;
    options.wrap_mm = source.wrap_mm;
    options.levels = source.levels;
    options.target_tets = source.tets;
    options.edge_lengths_mm = source.edge_lengths_mm;
    options.voxel_mm = source.voxel_mm;
    options.smoothing_mm = source.smoothing_mm;
}

}  // namespace

MeshedInput mesh_input(const MeshSource& source, const ProgressCallback& progress,
                       MeshingOptions options, const SceneGrading& grading) {
    refuse_idle_keys(source);
    take_keys(source, grading, options);
    std::string from = image_filename(source.file).string();
    MeshedInput meshed;
    TriangleMesh surface;
    LabelImage labels;
    std::vector<std::string> image_notes;
    Materials materials;
    if (is_image_name(source.file)) {
        labels = source.threshold.empty() ? labels_of(source, image_notes)
                                          : between_thresholds(source, image_notes);
        if (progress) progress(0, "surface of the image");
        meshed.image =
            with_context(source.file.string(), [&] { return surface_of_labels(labels, options); });
        surface = meshed.image->surface;
        options.body = {Cavities::keep, Parts::all, 0};  // the surface has what was chosen
        materials.several = meshed.image->label_voxels.size() > 1;
        materials.volume_m3 = meshed.image->body_volume_m3;
        materials.field = [&] {
            return LabelField(labels,
                              {options.labels, meshed.image->voxel_mm, meshed.image->smoothing_mm,
                               meshed.image->iso_level, source.body});
        };
        std::vector<std::int32_t> in_body;
        for (const auto& [label, count] : meshed.image->label_voxels) in_body.push_back(label);
        from += source.threshold.empty() ? fmt::format(", labels {}", fmt::join(in_body, ", "))
                                         : fmt::format(", threshold {}", source.threshold);
        from += fmt::format(", smoothed by {:.3g} mm on a grid of {:.3g} mm",
                            meshed.image->smoothing_mm, meshed.image->voxel_mm);
    } else {
        surface = read_surface(source.file, source.space);
        if (source.unit == LengthUnit::metre)
            for (Vector3& x : surface.nodes) x *= 1e3;  // read as mm
        check_size(surface.nodes, source);
        from += fmt::format(" in {}, {}", source.unit == LengthUnit::metre ? "m" : "mm",
                            source.space == Space::lps ? "LPS" : "RAS");
    }
    try {
        meshed.result = build_hierarchy(surface, options, progress, {}, materials);
    } catch (const MeshingFailure& failure) {
        throw MeshingFailure(fmt::format("{}: {}", source.file.string(), failure.what()),
                             failure.surface);
    } catch (const Error& error) {
        fail("{}: {}", source.file.string(), error.what());
    }
    MeshHierarchy& hierarchy = meshed.result.hierarchy;
    if (meshed.image) {
        const double voxel_m3 = std::abs(labels.ras_from_voxel.topLeftCorner<3, 3>().determinant());
        auto& notes = meshed.result.notes;
        image_notes.insert(image_notes.end(), meshed.image->notes.begin(),
                           meshed.image->notes.end());
        notes.insert(notes.begin(), image_notes.begin(), image_notes.end());
        note_what_lies_apart(meshed, voxel_m3, source);
        meshed.grid = ImageGrid{labels.size, labels.ras_from_voxel};
        const auto tets = region_volumes(hierarchy.levels.front());
        const auto own_m3 = [&](std::int32_t label) {
            return voxel_m3 * static_cast<double>(meshed.image->label_voxels.at(label));
        };
        for (const LabelField::Material& m : meshed.result.materials)
            if (tets.contains(m.label))
                meshed.regions.push_back({m.label, own_m3(m.label), tets.at(m.label)});
        const std::int32_t only = meshed.image->label_voxels.begin()->first;
        if (source.threshold.empty())
            for (TetMesh& level : hierarchy.levels)
                if (level.regions.empty()) level.regions.assign(level.tets.size(), only);
    }
    hierarchy = with_refined_levels(std::move(hierarchy), source.refine);
    hierarchy.provenance =
        fmt::format("livetet {} from {}: {}", LIVETET_VERSION, from, hierarchy.provenance);
    return meshed;
}

GridInput grid_input(const MeshSource& source) {
    refuse_idle_keys(source);
    GridInput input;
    const LabelImage labels = source.threshold.empty() ? labels_of(source, input.notes)
                                                       : between_thresholds(source, input.notes);
    input.image = grid_of(labels);
    input.grid = with_context(source.file.string(), [&] {
        return voxel_grid(labels, {source.labels.begin(), source.labels.end()}, source.body,
                          source.tets);
    });
    input.notes.insert(input.notes.end(), input.grid.notes.begin(), input.grid.notes.end());
    check_size(input.grid.mesh.nodes, source);
    const auto [i, j, k] = input.grid.voxels_a_cell;
    input.hierarchy =
        make_hierarchy({std::move(input.grid.mesh)},
                       fmt::format("livetet {} from {}: a grid of hexahedra of {} x {} x {} voxels",
                                   LIVETET_VERSION, image_filename(source.file).string(), i, j, k));
    return input;
}

void fail_with_surface(const MeshingFailure& failure, const std::filesystem::path& look,
                       const std::filesystem::path& input) {
    if (same_file(look, input)) fail("{}", failure.what());
    std::string where = fmt::format("the surface that it was tried with: {}", look.string());
    try {
        write_surface(look, failure.surface, Space::ras);
    } catch (const Error& error) {
        where = fmt::format("nor could its surface be written: {}", error.what());
    }
    fail("{} ({})", failure.what(), where);
}

}  // namespace livetet
