#include "meshing/image_surface.hpp"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <fmt/ranges.h>
#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/error.hpp"
#include "image/axis_filter.hpp"
#include "meshing/body_mask.hpp"
#include "meshing/shells.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

constexpr double surface_volume_limit = 0.01;  ///< relative error of the volume, guaranteed
constexpr double volume_aim = 0.001;           ///< relative error of the volume, target

/// Finest useful grid for an organ, whatever its voxels.
constexpr double organ_detail_mm = 1.5;
constexpr double details_across = 60;  ///< and for a smaller body, as a fraction of its size
constexpr int max_halvings = 2;

constexpr double max_samples = 1e8;  ///< of the grid (0.4 GB), unless the image has more voxels
constexpr double largest_body_m = 10;
constexpr double min_connected_share =
    0.02;  ///< minimum share of the chosen voxels in the largest part

struct Field {
    std::array<int, 3> size{};
    Eigen::Matrix4d ras_from_sample;
    vtkNew<vtkImageData> image;
};

/// Largest number of samples that `smooth` holds at once; it filters axis by axis.
double samples_of(const Image<std::uint8_t>& mask, double sigma_m, double step_m) {
    double now = static_cast<double>(mask.values.size()), max_voxels = 0;
    for (const int axis : {2, 1, 0}) {
        const double spacing = mask.ras_from_voxel.col(axis).head<3>().norm();
        now *= gaussian_samples(mask.size[axis], std::max(sigma_m / spacing, min_smoothing_voxels),
                                step_m / spacing) /
               mask.size[axis];
        max_voxels = std::max(max_voxels, now);
    }
    return max_voxels;
}

/// Smooths the mask's indicator by `sigma_m` and samples it every `step_m` along the mask's axes.
void smooth(const Image<std::uint8_t>& mask, double sigma_m, double step_m, Field& field) {
    std::vector<float> values(mask.values.begin(), mask.values.end());
    field.size = mask.size;
    Eigen::Matrix4d voxel_from_sample = Eigen::Matrix4d::Identity();
    for (const int axis :
         // Slowest axis first: it is usually the coarsest, and its filter runs over long rows.
         {2, 1, 0}) {
        const double spacing = mask.ras_from_voxel.col(axis).head<3>().norm();
        const double sigma = std::max(sigma_m / spacing, min_smoothing_voxels);
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

/// The shells of the iso-surface, metres: as many pieces and cavities as wanted, or as there are if
/// they are fewer, the largest ones.
TriangleMesh iso_surface(const Field& field, double level, const ShellCount& wanted) {
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
        surface.triangles.push_back({static_cast<std::int32_t>(corner[0]),
                                     static_cast<std::int32_t>(corner[1]),
                                     static_cast<std::int32_t>(corner[2])});
    // All parts have the same winding, so the sign of the total volume (bodies minus cavities)
    // tells the winding.
    if (signed_volume(surface) < 0)
        for (Triangle& t : surface.triangles) std::swap(t[1], t[2]);
    return largest_shells(surface, wanted);
}

/// Finds by bisection the iso-value whose surface encloses `volume`; a higher value encloses less.
TriangleMesh surface_of_volume(const Field& field, double volume, const ShellCount& wanted,
                               double& level) {
    double low = 0.05, high = 0.95;
    level = 0.5 + 1e-4;  // avoids the exact value of symmetric masks at grid points
    TriangleMesh surface;
    for (int step = 0;; ++step) {
        surface = iso_surface(field, level, wanted);
        const double miss = signed_volume(surface) / volume - 1;
        if (std::abs(miss) <= volume_aim || step == 11) break;
        (miss > 0 ? low : high) = level;
        level = (low + high) / 2;
    }
    return surface;
}

ShellCount wanted_shells(const ImageSurface& image) {
    return {image.parts_m3.size(), image.cavities_m3.size()};
}

/// Gives each shell the volume of its voxels. One iso-value for all shells keeps only the volume
/// between them: smoothing shrinks a cavity as it shrinks a body.
void keep_shell_volumes(ImageSurface& image) {
    std::vector<BodyPiece> pieces = pieces_of(image.surface);
    if (!(count_shells(pieces) == wanted_shells(image)) || image.surface.triangles.empty()) return;
    std::vector<TriangleMesh*> cavities;
    for (BodyPiece& piece : pieces)
        for (TriangleMesh& cavity : piece.cavities) cavities.push_back(&cavity);
    if (pieces.size() + cavities.size() == 1) return;
    std::stable_sort(cavities.begin(), cavities.end(),
                     [](const TriangleMesh* a, const TriangleMesh* b) {
                         return signed_volume(*a) < signed_volume(*b);
                     });
    for (std::size_t c = 0; c < cavities.size(); ++c)
        shift_to_volume(*cavities[c], -image.cavities_m3[c]);
    const double parts_m3 = std::accumulate(image.parts_m3.begin(), image.parts_m3.end(), 0.0);
    for (std::size_t p = 0; p < pieces.size(); ++p) {
        double hollow = 0;
        for (const TriangleMesh& cavity : pieces[p].cavities) hollow += signed_volume(cavity);
        const double with_filled = image.body_volume_m3 / parts_m3 * image.parts_m3[p];
        shift_to_volume(pieces[p].outer, with_filled - hollow);
    }
    image.surface = joined(pieces);
}

/// Cuts the surface with the spacing and smoothing in `result`; increases the smoothing until the
/// surface is manifold.
void cut(const Image<std::uint8_t>& mask, ImageSurface& result) {
    result.smoothing_mm = std::max(result.smoothing_mm, 0.3 * result.voxel_mm);
    for (int tries = 1;; ++tries, result.smoothing_mm *= 1.3) {
        Field field;
        smooth(mask, 1e-3 * result.smoothing_mm, 1e-3 * result.voxel_mm, field);
        result.surface = surface_of_volume(field, result.body_volume_m3, wanted_shells(result),
                                           result.iso_level);
        const bool closed =
            !result.surface.triangles.empty() && check_topology(result.surface).closed();
        if (closed || tries == 4) break;
    }
    keep_shell_volumes(result);
    result.surface_volume_m3 = signed_volume(result.surface);
}

bool keeps_volume(const ImageSurface& cut) {
    return std::abs(cut.surface_volume_m3 / cut.body_volume_m3 - 1) <= surface_volume_limit;
}

bool keeps_shells(const ImageSurface& cut) {
    return count_shells(pieces_of(cut.surface)) == wanted_shells(cut);
}

/// The body's voxels. Throws Error if the labels or the unit look wrong.
BodyMask checked_body(const LabelImage& image, const MeshingOptions& options) {
    const double voxel_volume = std::abs(image.ras_from_voxel.topLeftCorner<3, 3>().determinant());
    if (!(voxel_volume > 0) || !image.ras_from_voxel.allFinite())
        fail("image: its affine is singular (a voxel of {} mm^3), expected three independent axes",
             1e9 * voxel_volume);
    BodyMask body = body_mask(image, options.labels, options.body);
    if (static_cast<double>(body.body_voxels) <
        min_connected_share * static_cast<double>(body.picked_voxels))
        fail(
            "image: the largest part of the {} voxels picked, of those that share a face, has {}; "
            "expected labels (or a threshold) of a body that hangs together",
            body.picked_voxels, body.body_voxels);
    const Vector3 spacing = ImageGrid{image.size, image.ras_from_voxel}.spacing();
    const Vector3 extent = spacing.cwiseProduct(
        Vector3(body.mask.size[0], body.mask.size[1], body.mask.size[2]) - Vector3::Constant(2));
    if (!(extent.maxCoeff() <= largest_body_m))
        fail(
            "image: the body is {:.0f} x {:.0f} x {:.0f} mm large, of voxels of {:.4g} x {:.4g} x "
            "{:.4g} mm, expected at most {:.0f} mm: is the unit right that the file states?",
            1e3 * extent.x(), 1e3 * extent.y(), 1e3 * extent.z(), 1e3 * spacing.x(),
            1e3 * spacing.y(), 1e3 * spacing.z(), 1e3 * largest_body_m);
    return body;
}

/// Says what of the image's voxels is not meshed as the image has it.
void add_notes(ImageSurface& result, const BodyMask& body, double voxel_m3,
               const MeshingOptions& options) {
    const auto ml = [&](std::int64_t voxels) {
        return 1e6 * voxel_m3 * static_cast<double>(voxels);
    };
    const std::string limit = fmt::format(
        "smaller than {:.3g} ml (--speck-ml)",
        1e6 * options.body.speck_m3(voxel_m3 * static_cast<double>(body.parts.front())));
    if (body.specks.count > 0)
        result.notes.push_back(fmt::format(
            "image: {} speck{} of {:.3g} ml in all left out: each is {}{}", body.specks.count,
            body.specks.count == 1 ? "" : "s", ml(body.specks.voxels), limit,
            body.lost_labels.empty() ? ""
                                     : fmt::format("; there is nothing else of label{} {}",
                                                   body.lost_labels.size() == 1 ? "" : "s",
                                                   fmt::join(body.lost_labels, ", "))));
    if (body.filled.count > 0)
        result.notes.push_back(fmt::format(
            "image: {} filled, by {:.4g} ml{}",
            body.filled.count == 1 ? "1 cavity" : fmt::format("{} cavities", body.filled.count),
            ml(body.filled.voxels),
            options.body.cavities == Cavities::keep ? ": each is " + limit : ""));
}

}  // namespace

ImageSurface surface_of_labels(const LabelImage& image, const MeshingOptions& options) {
    check_options(options);
    const BodyMask body = checked_body(image, options);
    const double voxel_volume = std::abs(image.ras_from_voxel.topLeftCorner<3, 3>().determinant());
    ImageSurface result;
    result.label_volume_m3 = voxel_volume * static_cast<double>(body.picked_voxels);
    result.body_volume_m3 = voxel_volume * static_cast<double>(body.body_voxels);
    result.label_voxels = body.label_voxels;
    result.left_out = body.left_out;
    result.filled_volume_m3 = voxel_volume * static_cast<double>(body.filled.voxels);
    for (const std::int64_t n : body.parts)
        result.parts_m3.push_back(voxel_volume * static_cast<double>(n));
    for (const std::int64_t n : body.cavities)
        result.cavities_m3.push_back(voxel_volume * static_cast<double>(n));
    add_notes(result, body, voxel_volume, options);

    // Grid and smoothing, as requested or from the sizes of voxels and body.
    const double voxel_size_mm = 1e3 * std::cbrt(voxel_volume),
                 body_size_mm = 1e3 * std::cbrt(result.body_volume_m3);
    const double max_grid_samples =
        std::max(max_samples, static_cast<double>(body.mask.values.size()));
    const auto samples = [&](double voxel_mm, double smoothing_mm) {
        return samples_of(body.mask, 1e-3 * smoothing_mm, 1e-3 * voxel_mm);
    };
    double voxel_mm = options.voxel_mm.value_or(
        std::max(voxel_size_mm / 2, std::min(body_size_mm / details_across, organ_detail_mm)));
    double smoothing_mm =
        options.smoothing_mm.value_or(std::max(voxel_mm, std::min(voxel_size_mm, organ_detail_mm)));
    for (int wider = 0;
         !options.voxel_mm && wider < 50 && samples(voxel_mm, smoothing_mm) > max_grid_samples;
         ++wider)
        voxel_mm *= 1.2;
    if (const double n = samples(voxel_mm, smoothing_mm); !(n <= max_grid_samples))
        fail(
            "image: a grid of {:.3g} mm over the body has {:.2g} samples, expected at most {:.2g}: "
            "take a larger --voxel-mm (in a scene mesh.voxel_mm), or a smaller --smoothing-mm than "
            "{:.3g}",
            voxel_mm, n, max_grid_samples, smoothing_mm);
    for (int halvings = 0;; ++halvings) {
        result.voxel_mm = voxel_mm;
        result.smoothing_mm = smoothing_mm;
        cut(body.mask, result);
        if (!options.voxel_mm) voxel_mm /= 2;
        if (!options.smoothing_mm) smoothing_mm /= 2;
        const bool asked = options.voxel_mm && options.smoothing_mm;
        if ((keeps_volume(result) && keeps_shells(result)) || asked || halvings == max_halvings ||
            samples(voxel_mm, smoothing_mm) > max_grid_samples)
            break;
    }
    if (!keeps_volume(result))
        fail(
            "image: smoothed by {:.2f} mm on a grid of {:.2f} mm, the surface encloses {:.4g} ml "
            "of a body of {:.4g} ml; expected within 1 %: the body is too small or thin, take a "
            "smaller --smoothing-mm and --voxel-mm (in a scene mesh.smoothing_mm, mesh.voxel_mm)",
            result.smoothing_mm, result.voxel_mm, 1e6 * result.surface_volume_m3,
            1e6 * result.body_volume_m3);
    if (const SurfaceTopology t = check_topology(result.surface); !t.closed())
        fail(
            "image: smoothed by up to {:.2f} mm, the surface has {} border and {} non-manifold "
            "edges, first at {}; take a larger --smoothing-mm (in a scene mesh.smoothing_mm)",
            result.smoothing_mm, t.border_edges, t.non_manifold_edges, place_mm(t.place));
    if (const ShellCount kept = count_shells(pieces_of(result.surface)),
        wanted = wanted_shells(result);
        !(kept == wanted))
        fail(
            "image: smoothed by {:.2f} mm on a grid of {:.2f} mm, the surface has {} of the body's "
            "{} parts and {} of its {} cavities: walls or gaps are too thin, take a smaller "
            "--smoothing-mm and --voxel-mm, or --fill-cavities (in a scene mesh.cavities: fill)",
            result.smoothing_mm, result.voxel_mm, kept.pieces, wanted.pieces, kept.cavities,
            wanted.cavities);
    const NearestTriangle tree(result.surface.nodes, result.surface.triangles);
    result.moved =
        distance_between(voxel_faces(body.mask), tree, std::numeric_limits<double>::infinity());
    return result;
}

}  // namespace livetet
