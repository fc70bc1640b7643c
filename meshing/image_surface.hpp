#pragma once

#include <map>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/options.hpp"
#include "meshing/surface_distance.hpp"

namespace livetet {

/// The surface of a body in a label map.
struct ImageSurface {
    TriangleMesh surface;          ///< closed, connected, wound outwards; metres, RAS
    double label_volume_m3 = 0;    ///< of all voxels with the chosen labels
    double body_volume_m3 = 0;     ///< of their largest connected part with holes filled
    double surface_volume_m3 = 0;  ///< enclosed by `surface`; within 1 % of the body's
    double iso_level =
        0.5;  ///< iso-value of the smoothed indicator, adjusted from 0.5 to keep the volume
    /// Distance from the voxels' outer faces to `surface`, caused by the smoothing; includes the
    /// voxels' stair steps.
    SurfaceDistance moved;
    /// Number of voxels of each label in the body.
    std::map<std::int32_t, std::int64_t> label_voxels;
    double voxel_mm = 0;  ///< spacing of the grid of the iso-surface
    /// Standard deviation used; larger than requested if the surface was not manifold with less.
    double smoothing_mm = 0;
};

/// The surface of the voxels whose label is in `options.labels` (all but 0 if empty): of their
/// largest part (connected by faces) with holes filled. It is an iso-surface of the indicator,
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
/// the memory, or smoothing cannot keep its volume within 1 %.
ImageSurface surface_of_labels(const LabelImage& image, const MeshingOptions& options);

}  // namespace livetet
