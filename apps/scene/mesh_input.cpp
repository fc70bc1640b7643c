#include "apps/scene/mesh_input.hpp"

#include <fmt/ranges.h>

#include <Eigen/Dense>

#include <algorithm>
#include <map>

#include "base/error.hpp"
#include "base/file.hpp"
#include "image/label_map.hpp"
#include "io/image_file.hpp"
#include "io/surface_file.hpp"
#include "meshing/interfaces.hpp"
#include "meshing/refine.hpp"

namespace livetet {

namespace {

/// Number of voxels of each picked label.
std::map<std::int32_t, std::int64_t> voxel_counts(const LabelImage& image,
                                                  std::span<const std::int32_t> picked) {
    std::map<std::int32_t, std::int64_t> counts;
    std::int64_t* count = nullptr;
    for (std::size_t n = 0; n < image.values.size(); ++n) {
        const std::int32_t label = image.values[n];
        if (n == 0 || label != image.values[n - 1])
            count = is_picked(label, picked) ? &counts[label] : nullptr;
        if (count) ++*count;
    }
    return counts;
}

/// Adds notes on picked voxels apart from the body: by label, or for a threshold as a whole.
void note_what_lies_apart(MeshedInput& meshed, const LabelImage& image, const MeshSource& source) {
    const double voxel_ml =
        1e6 * std::abs(image.ras_from_voxel.topLeftCorner<3, 3>().determinant());
    for (const auto& [label, count] : voxel_counts(image, source.labels)) {
        const auto in_body = meshed.image->label_voxels.find(label);
        const std::int64_t apart =
            count - (in_body == meshed.image->label_voxels.end() ? 0 : in_body->second);
        if (static_cast<double>(apart) > 0.01 * static_cast<double>(count))
            meshed.result.notes.push_back(fmt::format(
                "{}: {:.2f} of its {:.2f} ml do not hang together with the largest part and are "
                "left out",
                source.threshold.empty() ? fmt::format("label {}", label)
                                         : fmt::format("threshold {}", source.threshold),
                voxel_ml * static_cast<double>(apart), voxel_ml * static_cast<double>(count)));
    }
}

constexpr const char* advice =
    "a grey image is meshed between thresholds: --threshold LOW:HIGH (in a scene mesh.threshold)";

/// Reads a label map. If no labels were picked, refuses one that looks like a grey image.
LabelImage labels_of(const MeshSource& source) {
    LabelImage image;
    try {
        image = read_label_image(source.file);
    } catch (const NotALabel& e) {
        fail("{}; {}", e.what(), advice);
    }
    if (!source.labels.empty()) return image;
    if (const std::string why = why_no_label_map(image); !why.empty())
        fail(
            "{}: looks like a grey image ({}), expected labels; {}, a label map's labels are "
            "picked by --labels",
            source.file.string(), why, advice);
    return image;
}

/// A mask: 1 in the voxels whose grey values lie in the requested range.
LabelImage between_thresholds(const MeshSource& source) {
    const std::string where = source.file.string();
    if (!source.labels.empty())
        fail("{}: both labels and threshold ({}) are given, expected one of them", where,
             source.threshold);
    const auto [low, high] = range_of(source.threshold).value();
    const GreyImage grey = read_grey_image(source.file);
    LabelImage image{grey.size, grey.ras_from_voxel, std::vector<std::int32_t>(grey.values.size())};
    for (std::size_t n = 0; n < grey.values.size(); ++n)
        image.values[n] = grey.values[n] >= low && grey.values[n] <= high;
    if (std::find(image.values.begin(), image.values.end(), 1) == image.values.end()) {
        const auto [min, max] = std::minmax_element(grey.values.begin(), grey.values.end());
        fail("{}: no voxel is within the threshold {}, its values are {} to {}", where,
             source.threshold, *min, *max);
    }
    return image;
}

}  // namespace

MeshedInput mesh_input(const MeshSource& source, const ProgressCallback& progress,
                       MeshingOptions options) {
    refuse_idle_keys(source);
    options.labels.assign(source.labels.begin(), source.labels.end());
    options.levels = source.levels;
    options.target_tets = source.tets;
    options.edge_lengths_mm = source.edge_lengths_mm;
    options.voxel_mm = source.voxel_mm;
    options.smoothing_mm = source.smoothing_mm;
    std::string from = source.file.filename().string();
    MeshedInput meshed;
    TriangleMesh surface;
    LabelImage labels;
    Materials materials;
    if (is_image_name(source.file)) {
        labels = source.threshold.empty() ? labels_of(source) : between_thresholds(source);
        if (progress) progress(0, "surface of the image");
        meshed.image =
            with_context(source.file.string(), [&] { return surface_of_labels(labels, options); });
        surface = meshed.image->surface;
        materials.several = meshed.image->label_voxels.size() > 1;
        materials.volume_m3 = meshed.image->body_volume_m3;
        materials.field = [&] {
            return LabelField(labels, {options.labels, meshed.image->voxel_mm,
                                       meshed.image->smoothing_mm, meshed.image->iso_level});
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
        note_what_lies_apart(meshed, labels, source);
        meshed.grid = ImageGrid{labels.size, labels.ras_from_voxel};
        const auto tets = region_volumes(hierarchy.levels.front());
        for (const LabelField::Material& m : meshed.result.materials)
            if (tets.contains(m.label))
                meshed.regions.push_back({m.label, m.voxels_m3, tets.at(m.label)});
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
