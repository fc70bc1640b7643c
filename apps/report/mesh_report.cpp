#include "apps/report/mesh_report.hpp"

#include <fmt/format.h>

#include "meshing/quality.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

using nlohmann::json;

json to_json(const Vector3& place) { return {1e3 * place.x(), 1e3 * place.y(), 1e3 * place.z()}; }

json to_json(const MeshQuality& q) {
    json worst = json::array();
    for (const auto& tet : q.worst)
        worst.push_back({{"tet", tet.tet},
                         {"min_dihedral_deg", tet.min_dihedral_deg},
                         {"radius_ratio", tet.radius_ratio},
                         {"place_mm", to_json(tet.place)}});
    return {{"tets", q.tets},
            {"nodes", q.nodes},
            {"volume_ml", 1e6 * q.volume_m3},
            {"mean_edge_mm", 1e3 * q.mean_edge_m},
            {"min_dihedral_deg", q.min_dihedral_deg},
            {"max_dihedral_deg", q.max_dihedral_deg},
            {"min_radius_ratio", q.min_radius_ratio},
            {"dihedral_counts_of_10_deg", q.dihedral_counts},
            {"worst", worst}};
}

std::string angles_text(const MeshQuality& finest) {
    return "dihedral angles of level 0\n" + dihedral_histogram(finest);
}

#ifdef LIVETET_IMAGES
std::vector<double> in_ml(std::vector<double> volumes_m3) {
    for (double& v : volumes_m3) v *= 1e6;
    return volumes_m3;
}

json to_json(const SurfaceDistance& d) {
    return {{"max_mm", 1e3 * d.max_m},
            {"mean_mm", 1e3 * d.mean_m},
            {"farthest_mm", to_json(d.farthest)}};
}

json to_json(const LevelReport& level) {
    json of_level = to_json(level.quality);
    of_level.update({{"edge_mm", 1e3 * level.edge_length_m},
                     {"volume_ratio", level.volume_ratio},
                     {"to_surface", to_json(level.distance.to_body)},
                     {"from_surface", to_json(level.distance.from_body)},
                     {"filled_by", level.filled_by},
                     {"not_taken", level.dropped},
                     {"moves", level.optimise.moves},
                     {"flips", level.optimise.flips},
                     {"collapses", level.optimise.collapses},
                     {"peeled_tets", level.optimise.peeled_tets},
                     {"fillings", level.fillings},
                     {"seconds", level.seconds}});
    return of_level;
}

std::string picked_text(const ImageSurface& image) {
    return fmt::format(
        "picked       {:.4g} ml; the body {:.4g} ml{}; its surface encloses {:.4g} ml "
        "({:+.2f} %), {:.2f} mm from the voxels' faces in the mean, {:.2f} mm at most, at {}\n",
        1e6 * image.label_volume_m3, 1e6 * image.body_volume_m3,
        image.filled_volume_m3 > 0
            ? fmt::format(" with {:.4g} ml of filled cavities", 1e6 * image.filled_volume_m3)
            : "",
        1e6 * image.surface_volume_m3, 100 * (image.surface_volume_m3 / image.body_volume_m3 - 1),
        1e3 * image.moved.mean_m, 1e3 * image.moved.max_m, place_mm(image.moved.farthest));
}

json to_json(const ImageSurface& image, const ImageGrid& grid) {
    const Eigen::Matrix4d& affine = grid.ras_from_voxel;
    json rows = json::array();  // mm, RAS
    for (int i = 0; i < 3; ++i)
        rows.push_back(
            {1e3 * affine(i, 0), 1e3 * affine(i, 1), 1e3 * affine(i, 2), 1e3 * affine(i, 3)});
    return {{"size", grid.size},
            {"spacing_mm", to_json(grid.spacing())},
            {"ras_from_voxel_mm", rows},
            {"labels_ml", 1e6 * image.label_volume_m3},
            {"body_ml", 1e6 * image.body_volume_m3},
            {"filled_ml", 1e6 * image.filled_volume_m3},
            {"cavities_ml", in_ml(image.cavities_m3)},
            {"parts_ml", in_ml(image.parts_m3)},
            {"surface_ml", 1e6 * image.surface_volume_m3},
            {"voxel_mm", image.voxel_mm},
            {"smoothing_mm", image.smoothing_mm},
            {"moved", to_json(image.moved)}};
}
#endif

}  // namespace

MeshReport report_of(const MeshHierarchy& hierarchy) {
    MeshReport report{"", {{"levels", json::array()}}};
    std::vector<MeshQuality> qualities;
    for (const TetMesh& level : hierarchy.levels)
        report.json["levels"].push_back(to_json(qualities.emplace_back(measure_quality(level))));
    report.text = quality_table(qualities) + "\n" + angles_text(qualities.front());
    return report;
}

#ifdef LIVETET_IMAGES
MeshReport report_of(const MeshedInput& meshed) {
    MeshReport report{"", {{"levels", json::array()}, {"notes", meshed.result.notes}}};
    if (meshed.image) {
        report.text = picked_text(*meshed.image);
        report.json["image"] = to_json(*meshed.image, meshed.grid.value());
    }
    // Refined levels come before meshed ones.
    const auto& levels = meshed.result.hierarchy.levels;
    const std::size_t refined = levels.size() - meshed.result.levels.size();
    std::vector<MeshQuality> qualities;
    for (std::size_t l = 0; l < levels.size(); ++l) {
        const LevelReport* made = l < refined ? nullptr : &meshed.result.levels[l - refined];
        qualities.push_back(made ? made->quality : measure_quality(levels[l]));
        report.json["levels"].push_back(made ? to_json(*made) : to_json(qualities.back()));
    }
    report.text += quality_table(qualities) + "\n" + level_table(meshed.result.levels, refined) +
                   "\n" + angles_text(qualities.front());
    if (meshed.regions.size() > 1)
        for (const RegionVolume& r : meshed.regions) {
            report.text += fmt::format(
                "region {:>5} {:>9.4g} ml of tets, {:.4g} ml of voxels ({:+.1f} %)\n", r.label,
                1e6 * r.tets_m3, 1e6 * r.voxels_m3, 100 * (r.tets_m3 / r.voxels_m3 - 1));
            report.json["regions"].push_back({{"label", r.label},
                                              {"tets_ml", 1e6 * r.tets_m3},
                                              {"voxels_ml", 1e6 * r.voxels_m3}});
        }
    for (const std::string& note : meshed.result.notes)
        report.text += fmt::format("note         {}\n", note);
    return report;
}
#endif

}  // namespace livetet
