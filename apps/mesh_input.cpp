#include "apps/mesh_input.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <map>
#include <unordered_set>

#include "base/error.hpp"
#include "io/image_file.hpp"
#include "io/surface_file.hpp"
#include "mesh/label_regions.hpp"
#include "meshing/interfaces.hpp"

namespace livetet {

namespace {

/// How many voxels of the image each of the labels chosen has.
std::map<std::int32_t, std::int64_t> voxel_counts(const LabelImage& image, std::span<const std::int32_t> chosen) {
    std::map<std::int32_t, std::int64_t> counts;
    std::int64_t* count = nullptr;
    for (std::size_t n = 0; n < image.values.size(); ++n) {
        const std::int32_t label = image.values[n];
        if (n == 0 || label != image.values[n - 1]) {
            const bool named = std::find(chosen.begin(), chosen.end(), label) != chosen.end();
            count = label != 0 && (chosen.empty() || named) ? &counts[label] : nullptr;
        }
        if (count) ++*count;
    }
    return counts;
}

/// What the materials' voxels and tets fill, and notes of labels that lie mostly apart from the body.
void compare_regions(MeshedInput& meshed, const LabelImage& image, std::span<const std::int32_t> chosen) {
    const double voxel = std::abs(image.ras_from_voxel.topLeftCorner<3, 3>().determinant());
    const auto tets = region_volumes(meshed.result.hierarchy.levels.front());
    for (const auto& [label, count] : voxel_counts(image, chosen)) {
        const auto& materials = meshed.result.materials;
        const auto material =
            std::find_if(materials.begin(), materials.end(), [&](const auto& m) { return m.label == label; });
        const double all = voxel * static_cast<double>(count);
        const double in_body = material == materials.end() ? 0 : material->voxels_m3;
        if (in_body < 0.99 * all)
            meshed.result.notes.push_back(
                fmt::format("label {}: {:.2f} of its {:.2f} ml do not hang together with the "
                            "largest part and are left out",
                            label, 1e6 * (all - in_body), 1e6 * all));
        if (tets.contains(label)) meshed.regions.push_back({label, in_body, tets.at(label)});
    }
}

/// Anatomical label maps name fewer tissues than this; 8-bit grey images have more values.
constexpr std::size_t most_labels = 200;

constexpr const char* advice =
    "a grey image is meshed between thresholds: --threshold LOW:HIGH (in a scene mesh.threshold)";

/// The label map of a file; where the user has not picked labels, it may not look like a grey image.
LabelImage labels_of(const MeshSource& source) {
    LabelImage image;
    try {
        image = read_label_image(source.file);
    } catch (const NotALabel& e) {
        fail("{}; {}", e.what(), advice);
    }
    if (!source.labels.empty()) return image;
    std::unordered_set<std::int32_t> values;
    for (std::size_t n = 0; n < image.values.size(); ++n) {
        if (n > 0 && image.values[n] == image.values[n - 1]) continue;
        values.insert(image.values[n]);
        if (image.values[n] < 0 || values.size() > most_labels)
            fail("{}: looks like a grey image ({}), expected labels; {}, a label map's labels are picked by --labels",
                 source.file.string(),
                 image.values[n] < 0 ? fmt::format("a voxel is {}", image.values[n])
                                     : fmt::format("more than {} different values", most_labels),
                 advice);
    }
    return image;
}

/// 1 in the voxels of a grey image whose values lie in the range asked for.
LabelImage between_thresholds(const MeshSource& source) {
    const std::string where = source.file.string();
    if (!source.labels.empty())
        fail("{}: both labels and threshold ({}) are given, expected one of them", where, source.threshold);
    const auto [low, high] = range_of(source.threshold).value();
    const GreyImage grey = read_grey_image(source.file);
    LabelImage image{grey.size, grey.ras_from_voxel, std::vector<std::int32_t>(grey.values.size())};
    for (std::size_t n = 0; n < grey.values.size(); ++n)
        image.values[n] = grey.values[n] >= low && grey.values[n] <= high;
    if (std::find(image.values.begin(), image.values.end(), 1) == image.values.end()) {
        const auto [least, most] = std::minmax_element(grey.values.begin(), grey.values.end());
        fail("{}: no voxel lies in the threshold {}, its values are {} to {}", where, source.threshold, *least, *most);
    }
    return image;
}

}  // namespace

MeshedInput mesh_input(const MeshSource& source, const ProgressCallback& progress, MeshingOptions options) {
    options.labels.assign(source.labels.begin(), source.labels.end());
    options.levels = source.levels;
    options.target_tets = source.tets;
    options.edge_lengths_mm = source.edge_lengths_mm;
    const std::string name = source.file.filename().string();
    MeshedInput meshed;
    TriangleMesh surface;
    LabelImage labels;
    Materials materials;
    if (is_image_name(source.file)) {
        labels = source.threshold.empty() ? labels_of(source) : between_thresholds(source);
        if (progress) progress(0, "surface of the image");
        meshed.image = naming(source.file.string(), [&] { return surface_of_labels(labels, options); });
        surface = meshed.image->surface;
        materials.several = source.threshold.empty() && voxel_counts(labels, options.labels).size() > 1;
        materials.field = [&] {
            return LabelField(labels,
                              {options.labels, options.voxel_mm, meshed.image->smoothing_mm, meshed.image->iso_level});
        };
    } else {
        if (!source.threshold.empty())
            fail("{}: is a surface, a threshold ({}) is for grey images", source.file.string(), source.threshold);
        surface = read_surface(source.file, source.space);
    }
    try {
        meshed.result = build_hierarchy(surface, options, progress, {}, materials);
    } catch (const MeshingFailure& failure) {
        throw MeshingFailure(fmt::format("{}: {}", source.file.string(), failure.what()), failure.surface);
    } catch (const Error& error) {
        fail("{}: {}", source.file.string(), error.what());
    }
    MeshHierarchy& hierarchy = meshed.result.hierarchy;
    if (meshed.image && source.threshold.empty()) {
        for (TetMesh& level : hierarchy.levels)
            if (level.regions.empty()) level.regions = regions_by_label(level, labels, options.labels);
        if (materials.several) compare_regions(meshed, labels, options.labels);
    }
    hierarchy.provenance = fmt::format("livetet {} from {}: {}", LIVETET_VERSION, name, hierarchy.provenance);
    return meshed;
}

}  // namespace livetet
