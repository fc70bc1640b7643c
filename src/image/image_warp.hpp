#pragma once

#include "base/thread_team.hpp"
#include "image/image_sampler.hpp"
#include "mesh/body_motion.hpp"

namespace livetet {

/// Statistics of a warped image's voxels.
struct WarpCounts {
    std::size_t carried = 0;  ///< inside the deformed body
    /// Inside the body at rest but outside the deformed body: their content is unknown.
    std::size_t left_empty = 0;
    std::size_t inverted = 0;      ///< carried voxels covered by inverted tets only
    std::size_t beyond_image = 0;  ///< voxels whose source position is outside the image
};

/// Warps an image with a deforming body and samples it on `grid`. A voxel with centre x takes
/// - the image at x - u inside the deformed body and its rind, u being the displacement of the
///   material at x (`TetRaster` says which tet counts if the body overlaps itself);
/// - `empty` where the body or its rind was at rest and has left;
/// - the image at x elsewhere.
///
/// Positions outside the image give `empty`. If `grid` is the image's own grid, unmoved voxels keep
/// their value to the bit. `counts` receives the statistics.
template <class T>
Image<T> warp_image(const Image<T>& image, const ImageGrid& grid, const BodyMotion& motion,
                    Interpolation how, T empty, ThreadTeam& team, WarpCounts& counts);

/// Direction of a displacement field.
enum class FieldDirection {
    /// Defined on the deformed body, points to the rest position: resamples images.
    /// Defined on the body at rest, points to the deformed position: moves points.
    inverse,
    forward,
};

/// Displacements at the voxels of `grid`, metres, RAS; 0 outside the body and its rind.
Image<Eigen::Vector3f> displacement_field(const ImageGrid& grid, const BodyMotion& motion,
                                          FieldDirection direction, ThreadTeam& team);

}  // namespace livetet
