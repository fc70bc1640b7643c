#pragma once

#include <span>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Whether markers are brighter or darker than their surroundings.
enum class MarkerShade { bright, dark };

struct MarkerOptions {
    /// Diameter of the visible ball, metres: of a marker's filling, not its casing.
    double diameter = 0.01;
    MarkerShade shade = MarkerShade::bright;
    double min_fit = 0.5;  ///< candidates with a lower `fit` are rejected
};

/// A ball found in an image.
struct ImageMarker {
    Vector3 centre;  ///< metres, RAS
    /// RMS error of the centre expected from the fit's residuals, metres.
    double uncertainty = 0;
    /// Difference between its value and the background; positive for dark markers, too.
    double contrast = 0;
    /// Share of the local variance that the ball model explains; 1 is perfect.
    double fit = 0;
    double score() const { return contrast * fit; }
};

/// Finds balls of a known diameter, the best (contrast times fit) first; no two are nearer than a
/// diameter.
///
/// Candidates are the maxima of a difference of Gaussians with standard deviations of 0.45 and 0.72
/// radii. Each is refined by least squares in a window a fifth larger than the ball:
///
///     value = b + g . x + a m(|x - c| - r)
///
/// with background b, its gradient g, contrast a and centre c. m is the covered share of a voxel;
/// its edge is a Gaussian with the standard deviation of the voxel's box along the normal, which
/// covers anisotropic, oblique, sheared and left-handed grids. The gradient keeps a sloping
/// background or another tissue on one side from shifting the centre.
///
/// Throws Error, naming the limit, if the diameter is less than two voxels or more than half of the
/// image.
std::vector<ImageMarker> find_markers(const GreyImage& image, const MarkerOptions& options);

}  // namespace livetet
