#pragma once

#include <span>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Whether markers are brighter or darker than what is round them.
enum class MarkerShade { bright, dark };

struct MarkerOptions {
    double diameter = 0.01;  ///< metres, of the ball that shows: a marker's filling, not its casing
    MarkerShade shade = MarkerShade::bright;
    double min_fit = 0.5;  ///< blobs of which the ball explains less are none
};

/// A ball found in an image.
struct ImageMarker {
    Vector3 centre;          ///< metres, RAS
    double uncertainty = 0;  ///< RMS length of the centre's error that noise makes, as the fit's
                             ///< residuals say, metres
    double contrast =
        0;  ///< its value less that of what is round it; above 0 for dark markers, too
    double fit =
        0;  ///< the share of the variance round it that a ball explains: 1 for a perfect one
    double score() const { return contrast * fit; }
};

/// Balls of a known diameter, the best (contrast times fit) first; no two nearer than a diameter.
/// Where they may be say the maxima of a difference of Gaussians of 0.45 and 0.72 radii; where they
/// are, least squares about each: value = b + g . x + a m(|x - c| - r), with m the share of a voxel
/// within the ball (its edge a Gaussian of the deviation that the voxel's box has in the normal's
/// direction: anisotropic, oblique, sheared and left-handed voxels alike), in a window a fifth
/// larger than the ball: a slope of the background or another tissue on one side does not pull the
/// centre. Throws Error, naming the limit, where the diameter is less than two voxels or more than
/// half of the image.
std::vector<ImageMarker> find_markers(const GreyImage& image, const MarkerOptions& options);

}  // namespace livetet
