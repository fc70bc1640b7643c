#include "apps/bench/front_organ.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "apps/bench/organ_places.hpp"
#include "apps/phantom/phantom.hpp"
#include "apps/phantom/phantom_shape.hpp"
#include "apps/phantom/phantom_truth.hpp"
#include "base/error.hpp"
#include "io/image_file.hpp"
#include "io/surface_file.hpp"
#include "mesh/point_locator.hpp"
#include "mesh/quadratic.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"

namespace livetet {

namespace {

constexpr double disc_radius = 0.015, edge_at_disc = 0.002;  // m
constexpr double held_share = 0.2;
constexpr TargetPlaces target_places{.deep = 0.008, .near = 0.045, .count = 30};

SimulatedTrackerOptions still_tracker() {
    SimulatedTrackerOptions tracker = phantom_tracker({});
    tracker.position_rms_mm = tracker.rotation_rms_deg = 0;
    return tracker;
}

TetMesh coarse_mesh_of(const TriangleMesh& surface, const ProgressCallback& progress) {
    MeshingOptions options;
    options.target_tets = 20000;
    options.target_tolerance = 0.3;
    options.levels = 1;
    return std::move(build_hierarchy(surface, options, progress).hierarchy.levels.front());
}

/// 1 where a voxel's centre is in the mesh.
LabelImage voxels_of(const TetMesh& mesh) {
    constexpr double spacing = 0.0015, margin = 0.01;  // m
    Eigen::AlignedBox3d box;
    for (const Vector3& x : mesh.nodes) box.extend(x);
    LabelImage labels;
    for (int d = 0; d < 3; ++d)
        labels.size[d] = static_cast<int>(std::ceil((box.sizes()[d] + 2 * margin) / spacing));
    labels.ras_from_voxel.topLeftCorner<3, 3>() *= spacing;
    labels.ras_from_voxel.topRightCorner<3, 1>() = box.min() - Vector3::Constant(margin);
    labels.values.assign(static_cast<std::size_t>(labels.size[0]) * labels.size[1] * labels.size[2],
                         0);
    const PointLocator locator(mesh);
    const Vector3 origin = labels.ras_from_voxel.topRightCorner<3, 1>();
    for (int k = 0; k < labels.size[2]; ++k)
        for (int j = 0; j < labels.size[1]; ++j)
            for (int i = 0; i < labels.size[0]; ++i) {
                const Vector3 x = origin + spacing * Vector3(i, j, k);
                if (box.contains(x)) labels.at(i, j, k) = locator.find(x).distance == 0;
            }
    return labels;
}

/// 1 behind a height along y (to the front), m.
LabelImage voxels_behind(const LabelImage& labels, double y) {
    LabelImage mask = labels;
    for (int k = 0; k < mask.size[2]; ++k)
        for (int j = 0; j < mask.size[1]; ++j)
            for (int i = 0; i < mask.size[0]; ++i)
                mask.at(i, j, k) =
                    (mask.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).y() < y ? 1 : 0;
    return mask;
}

}  // namespace

FrontOrgan phantom_front_organ() {
    return {"the phantom", make_phantom_images(0.0015, 1), make_phantom_images(0.00109, 1),
            still_tracker(), phantom::targets()};
}

FrontOrgan read_front_organ(const std::filesystem::path& file, int label,
                            const ProgressCallback& progress) {
    FrontOrgan organ{file.filename().string(), {}, {}, still_tracker(), {}};
    LabelImage& labels = organ.images.labels;
    TetMesh mesh;
    if (is_surface_name(file)) {
        mesh = coarse_mesh_of(read_surface(file, Space::ras), progress);
        labels = voxels_of(mesh);
    } else {
        labels = read_label_image(file);
        for (std::int32_t& value : labels.values) value = label == 0 ? value != 0 : value == label;
        mesh = coarse_mesh_of(surface_of_labels(labels, {}).surface, progress);
    }
    Eigen::AlignedBox3d box;
    for (const Vector3& x : mesh.nodes) box.extend(x);
    organ.images.fixed_mask = voxels_behind(labels, box.min().y() + held_share * box.sizes().y());
    const TriangleMesh surface{mesh.nodes, boundary_triangles(mesh.tets)};
    const SurfacePlace sensor = place_towards(surface, box.center(), Vector3::UnitY());
    organ.targets = targets_inside(mesh, sensor.place, target_places);
    organ.tracker.turn_centre_in_image = box.center();
    organ.tracker.image_from_reference.translation =
        Vector3(box.center().x(), box.min().y(), box.center().z());
    organ.tracker.image_from_sensor_at_rest.translation = sensor.place;
    organ.tracker.press_direction = -sensor.normal;
    return organ;
}

Truth press_front_organ(const FrontOrgan& organ, int tets, double poisson,
                        std::vector<double> depths, const ProgressCallback& progress) {
    Truth truth = true_motion(organ.tracker, {});
    truth.depths = std::move(depths);
    truth.patch_radius = disc_radius;
    const FineSphere finer{truth.sensor_rest, 1.5 * disc_radius, edge_at_disc};
    TruthModel model = rounded_press(disc_radius, poisson);
    model.rim_share = 1;
    const PhantomImages& images = organ.images;
    solve_truth(with_quadratic_level(
                    mesh_for_truth(images.labels, images.fixed_mask, tets, progress, finer)),
                organ.targets, truth, progress, model);
    return truth;
}

}  // namespace livetet
