#pragma once

#include <map>
#include <string>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/options.hpp"
#include "meshing/surface_distance.hpp"

namespace livetet {

/// The surface of a body in a label map.
struct ImageSurface {
    TriangleMesh surface;               ///< closed, wound outwards from the body; metres, RAS
    double label_volume_m3 = 0;         ///< of all voxels with the chosen labels
    double body_volume_m3 = 0;          ///< of those of the body, and of cavities that were filled
    double filled_volume_m3 = 0;        ///< of the cavities that were filled
    double surface_volume_m3 = 0;       ///< enclosed by `surface`; within 1 % of the body's
    std::vector<double> cavities_m3{};  ///< volumes of the voxels of each cavity, the largest first
    std::vector<double> parts_m3{};     ///< volumes of the voxels of each part, likewise
    /// What was filled or left out of the image's voxels, a line each, for the user.
    std::vector<std::string> notes{};
    double iso_level =
        0.5;  ///< iso-value of the smoothed indicator, adjusted from 0.5 to keep the volume
    /// Distance from the voxels' outer faces to `surface`, caused by the smoothing; includes the
    /// voxels' stair steps.
    SurfaceDistance moved;
    /// Number of the image's own voxels of each label in the body.
    std::map<std::int32_t, std::int64_t> label_voxels;
    /// Number of voxels of each label in parts that were left out, but for specks.
    std::map<std::int32_t, std::int64_t> left_out{};
    double voxel_mm = 0;  ///< spacing of the grid of the iso-surface
    /// Standard deviation used; larger than requested if the surface was not manifold with less.
    double smoothing_mm = 0;
};

/// The surface of the voxels whose label is in `options.labels` (all but 0 if empty): of the parts
/// (connected by faces) and with the cavities that `options.body` asks for. Each cavity has a shell
/// of its own, wound into it. The surface is an iso-surface of the indicator,
/// smoothed by a Gaussian (integrated over the voxels) and sampled on a grid. A body that the
/// image's border cuts is closed there. Any affine is allowed: left-handed, oblique, anisotropic.
///
/// With s the cube root of a voxel's volume and L that of the body's, the grid spacing is
/// `options.voxel_mm` or max(s / 2, min(L / 60, 1.5 mm)), and the Gaussian's standard deviation is
/// `options.smoothing_mm` or max(spacing, min(s, 1.5 mm)). Values that are not given are halved, at
/// most twice, if a thin body would lose volume.
///
/// Throws Error if a label is not in the image (listing the existing ones), the affine is singular,
/// the chosen voxels are too fragmented, the body is implausibly large for its unit or too fine for
/// the memory, or smoothing cannot keep its volume within 1 % and all its cavities and parts.
ImageSurface surface_of_labels(const LabelImage& image, const MeshingOptions& options);

}  // namespace livetet
