#include "apps/mesh_input.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <map>
#include <unordered_set>

#include "base/error.hpp"
#include "io/image_file.hpp"
#include "io/surface_file.hpp"
#include "mesh/label_regions.hpp"

namespace livetet {

namespace {

std::vector<RegionVolume> region_volumes(const LabelImage& image, const TetMesh& mesh) {
    std::map<std::int32_t, double> tets;
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) tets[mesh.regions[t]] += signed_volume(mesh, mesh.tets[t]);
    const double voxel = std::abs(image.ras_from_voxel.topLeftCorner<3, 3>().determinant());
    std::vector<RegionVolume> regions;
    for (const auto& [label, volume] : tets)
        regions.push_back(
            {label, voxel * static_cast<double>(std::count(image.values.begin(), image.values.end(), label)), volume});
    return regions;
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
    if (is_image_name(source.file)) {
        labels = source.threshold.empty() ? labels_of(source) : between_thresholds(source);
        if (progress) progress(0, "surface of the image");
        meshed.image = naming(source.file.string(), [&] { return surface_of_labels(labels, options); });
        surface = meshed.image->surface;
    } else {
        if (!source.threshold.empty())
            fail("{}: is a surface, a threshold ({}) is for grey images", source.file.string(), source.threshold);
        surface = read_surface(source.file, source.space);
    }
    try {
        meshed.result = build_hierarchy(surface, options, progress);
    } catch (const MeshingFailure& failure) {
        throw MeshingFailure(fmt::format("{}: {}", source.file.string(), failure.what()), failure.surface);
    } catch (const Error& error) {
        fail("{}: {}", source.file.string(), error.what());
    }
    MeshHierarchy& hierarchy = meshed.result.hierarchy;
    if (meshed.image && source.threshold.empty()) {
        for (TetMesh& level : hierarchy.levels) level.regions = regions_by_label(level, labels, options.labels);
        meshed.regions = region_volumes(labels, hierarchy.levels.front());
    }
    hierarchy.provenance = fmt::format("livetet {} from {}: {}", LIVETET_VERSION, name, hierarchy.provenance);
    return meshed;
}

}  // namespace livetet
