#pragma once

#include <map>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/options.hpp"
#include "meshing/surface_distance.hpp"

namespace livetet {

/// A body's surface cut from a label map.
struct ImageSurface {
    TriangleMesh surface;          ///< closed, one part, wound outwards; metres, RAS
    double label_volume_m3 = 0;    ///< of all voxels with the labels picked
    double body_volume_m3 = 0;     ///< of the largest connected part of them, its holes filled
    double surface_volume_m3 = 0;  ///< enclosed by `surface`: within 1 % of the body's
    double iso_level = 0.5;        ///< of the smoothed indicator, moved from 0.5 to keep the volume
    SurfaceDistance
        moved;  ///< from the voxels' outer faces to `surface`: what smoothing did, stairs and all
    std::map<std::int32_t, std::int64_t>
        label_voxels;     ///< how many voxels of each label the body has
    double voxel_mm = 0;  ///< of the grid that it was cut from
    double smoothing_mm =
        0;  ///< that it took; more than asked where the surface was not manifold with less
};

/// The surface of the voxels whose label is one of `options.labels` (all but 0 if empty): their
/// largest part (voxels that share a face), holes filled, as an iso-surface of the indicator
/// smoothed by a Gaussian (voxels taken as boxes) on a grid; a body that the image's border cuts is
/// closed there. Any affine will do: left-handed, oblique, anisotropic. With s the cubic root of a
/// voxel's volume and L that of the body's, the grid's spacing is `options.voxel_mm` or max(s / 2,
/// min(L / 60, 1.5 mm)), the Gaussian's standard deviation `options.smoothing_mm` or max(that
/// spacing, min(s, 1.5 mm)); what is not given is halved, twice at most, where a thin body would
/// lose volume. Throws Error if a label is not in the image (naming those that are), if the affine
/// is singular, if what was picked does not hang together, if the body is too large for its unit to
/// be right or too fine for memory, or if it is too small or thin for the smoothing to keep its
/// volume within 1 %.
ImageSurface surface_of_labels(const LabelImage& image, const MeshingOptions& options);

}  // namespace livetet
