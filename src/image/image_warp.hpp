#pragma once

#include "base/thread_team.hpp"
#include "image/image_sampler.hpp"
#include "mesh/body_motion.hpp"

namespace livetet {

/// What became of the voxels of a warped image.
struct WarpCounts {
    std::size_t carried = 0;  ///< by the body: they lie in it as it is deformed
    std::size_t left_empty =
        0;  ///< the body lay there at rest and has gone: nothing is known of them
    std::size_t inverted = 0;      ///< of the carried ones: by inverted tets alone
    std::size_t beyond_image = 0;  ///< of all: what should be there lies outside of the image
};

/// The image on `grid` as it is when the body is deformed. A voxel's centre x
///   in the deformed body and its rind: takes the image at x - u, where it lay at rest (see
///   TetRaster for which tet's u
///     counts where the body overlaps itself);
///   elsewhere, where the body or its rind lay at rest: takes `empty`;
///   elsewhere: stays as it is.
/// What lies beyond the image is `empty` too. On the image's own grid what stays is the same to the
/// bit.
template <class T>
Image<T> warp_image(const Image<T>& image, const ImageGrid& grid, const BodyMotion& motion,
                    Interpolation how, T empty, ThreadTeam& team, WarpCounts& counts);

/// Which way a field of displacements leads.
enum class FieldDirection {
    inverse,  ///< at a place in the deformed body, to where it lay at rest: what images are
              ///< resampled by
    forward,  ///< at a place of the body at rest, to where it is deformed: what points are moved by
};

/// The displacements at the voxels of `grid`, metres, RAS; 0 outside of the body and its rind.
Image<Eigen::Vector3f> displacement_field(const ImageGrid& grid, const BodyMotion& motion,
                                          FieldDirection direction, ThreadTeam& team);

}  // namespace livetet
