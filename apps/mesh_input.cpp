#include "apps/mesh_input.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <map>

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
    if (name.ends_with(".nii") || name.ends_with(".nii.gz")) {
        labels = read_label_image(source.file);
        if (progress) progress(0, "surface of the labels");
        meshed.image = naming(source.file.string(), [&] { return surface_of_labels(labels, options); });
        surface = meshed.image->surface;
    } else {
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
    if (meshed.image) {
        for (TetMesh& level : hierarchy.levels) level.regions = regions_by_label(level, labels, options.labels);
        meshed.regions = region_volumes(labels, hierarchy.levels.front());
    }
    hierarchy.provenance = fmt::format("livetet {} from {}: {}", LIVETET_VERSION, name, hierarchy.provenance);
    return meshed;
}

}  // namespace livetet
