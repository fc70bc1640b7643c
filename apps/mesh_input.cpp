#include "apps/mesh_input.hpp"

#include "base/error.hpp"
#include "io/image_file.hpp"
#include "io/surface_file.hpp"
#include "mesh/label_regions.hpp"

namespace livetet {

namespace {

MeshingOptions meshing_options(const MeshSource& source) {
    MeshingOptions options;
    options.labels.assign(source.labels.begin(), source.labels.end());
    options.levels = source.levels;
    options.target_tets = source.tets;
    options.edge_lengths_mm = source.edge_lengths_mm;
    return options;
}

}  // namespace

MeshedInput mesh_input(const MeshSource& source, const ProgressCallback& progress) {
    const MeshingOptions options = meshing_options(source);
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
    meshed.result = naming(source.file.string(), [&] { return build_hierarchy(surface, options, progress); });
    if (meshed.image)
        for (TetMesh& level : meshed.result.hierarchy.levels)
            level.regions = regions_by_label(level, labels, options.labels);
    meshed.result.hierarchy.provenance = fmt::format("livetet {} from {}", LIVETET_VERSION, name);
    return meshed;
}

}  // namespace livetet
