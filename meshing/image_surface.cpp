#include "meshing/image_surface.hpp"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "mesh/axis_filter.hpp"
#include "meshing/body_mask.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

constexpr double volume_limit = 0.01;  ///< relative, promised
constexpr double volume_aim = 0.001;   ///< relative, aimed at

struct Field {
    std::array<int, 3> size{};
    Eigen::Matrix4d ras_from_sample;
    vtkNew<vtkImageData> image;
};

/// The indicator of the mask, smoothed by `sigma_m` and sampled every `step_m` along the mask's axes.
void smooth(const Image<std::uint8_t>& mask, double sigma_m, double step_m, Field& field) {
    std::vector<float> values(mask.values.begin(), mask.values.end());
    field.size = mask.size;
    Eigen::Matrix4d voxel_from_sample = Eigen::Matrix4d::Identity();
    for (const int axis : {2, 1, 0}) {  // the slow axis first: it is most often the coarse one, and long runs are fast
        const double spacing = mask.ras_from_voxel.col(axis).head<3>().norm();
        const double sigma = std::max(sigma_m / spacing, least_smoothing_voxels);
        const AxisFilter filter = gaussian_beyond(field.size[axis], sigma, step_m / spacing);
        values = apply(filter, values, field.size, axis);
        voxel_from_sample(axis, axis) = filter.step;
        voxel_from_sample(axis, 3) = filter.origin;
    }
    field.ras_from_sample = mask.ras_from_voxel * voxel_from_sample;
    field.image->SetDimensions(field.size.data());
    field.image->AllocateScalars(VTK_FLOAT, 1);
    std::copy(values.begin(), values.end(), static_cast<float*>(field.image->GetScalarPointer()));
}

/// The largest part of the iso-surface, in metres, wound outwards.
TriangleMesh iso_surface(const Field& field, double level) {
    vtkNew<vtkFlyingEdges3D> edges;
    edges->SetInputData(field.image);
    edges->ComputeNormalsOff();
    edges->ComputeGradientsOff();
    edges->ComputeScalarsOff();
    edges->SetValue(0, level);
    edges->Update();
    vtkPolyData* cut = edges->GetOutput();
    TriangleMesh surface;
    for (vtkIdType i = 0; i < cut->GetNumberOfPoints(); ++i) {
        const Vector3 sample(cut->GetPoint(i));
        surface.nodes.push_back((field.ras_from_sample * sample.homogeneous()).head<3>());
    }
    vtkIdType corners = 0;
    const vtkIdType* corner = nullptr;
    auto* cells = cut->GetPolys();
    for (cells->InitTraversal(); cells->GetNextCell(corners, corner);)
        surface.triangles.push_back({static_cast<std::int32_t>(corner[0]), static_cast<std::int32_t>(corner[1]),
                                     static_cast<std::int32_t>(corner[2])});
    // All parts are wound alike: the sum of their volumes has the sign of the bodies', less their cavities.
    if (signed_volume(surface) < 0)
        for (Triangle& t : surface.triangles) std::swap(t[1], t[2]);
    return largest_part(surface);
}

/// Bisects for the level whose surface encloses `volume`: the higher the level, the less.
TriangleMesh surface_of_volume(const Field& field, double volume, double& level) {
    double low = 0.05, high = 0.95;
    level = 0.5 + 1e-4;  // just off the value that symmetric masks have right at grid points
    TriangleMesh surface;
    for (int step = 0; step < 12; ++step) {
        surface = iso_surface(field, level);
        const double miss = signed_volume(surface) / volume - 1;
        if (std::abs(miss) <= volume_aim) break;
        (miss > 0 ? low : high) = level;
        level = (low + high) / 2;
    }
    return surface;
}

}  // namespace

ImageSurface surface_of_labels(const LabelImage& image, const MeshingOptions& options) {
    check_options(options);
    const double voxel_volume = std::abs(image.ras_from_voxel.topLeftCorner<3, 3>().determinant());
    if (!(voxel_volume > 0) || !image.ras_from_voxel.allFinite())
        fail("image: its affine is singular (a voxel of {} mm^3), expected three independent axes", 1e9 * voxel_volume);
    const BodyMask body = largest_body(image, options.labels);

    ImageSurface result;
    result.label_volume_m3 = voxel_volume * static_cast<double>(body.picked_voxels);
    result.body_volume_m3 = voxel_volume * static_cast<double>(body.body_voxels);
    result.label_voxels = body.label_voxels;
    result.smoothing_mm = std::max(options.smoothing_mm, 0.3 * options.voxel_mm);
    for (int attempt = 0; attempt < 4; ++attempt, result.smoothing_mm *= 1.3) {
        Field field;
        smooth(body.mask, 1e-3 * result.smoothing_mm, 1e-3 * options.voxel_mm, field);
        result.surface = surface_of_volume(field, result.body_volume_m3, result.iso_level);
        if (!result.surface.triangles.empty() && check_topology(result.surface).closed()) break;
    }
    result.surface_volume_m3 = signed_volume(result.surface);
    if (!(std::abs(result.surface_volume_m3 / result.body_volume_m3 - 1) <= volume_limit))
        fail(
            "image: smoothed by {:.2f} mm, the surface encloses {:.3f} ml of a body of {:.3f} ml; expected within 1 %: "
            "the body is too small or thin, take a smaller meshing.smoothing_mm and meshing.voxel_mm",
            result.smoothing_mm, 1e6 * result.surface_volume_m3, 1e6 * result.body_volume_m3);
    if (const SurfaceTopology t = check_topology(result.surface); !t.closed())
        fail(
            "image: the surface has {} border and {} non-manifold edges, first at {}; take a larger "
            "meshing.smoothing_mm than {}",
            t.border_edges, t.non_manifold_edges, place_mm(t.place), options.smoothing_mm);
    const NearestTriangle tree(result.surface.nodes, result.surface.triangles);
    result.moved = distance_between(voxel_faces(body.mask), tree, std::numeric_limits<double>::infinity());
    return result;
}

}  // namespace livetet
