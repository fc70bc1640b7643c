#pragma once

#include <cstdint>

#include "image/image.hpp"

namespace livetet {

/// Images of the phantom, as of a scanner and a manual segmentation.
struct PhantomImages {
    GreyImage image;    ///< grey values as of a magnetic resonance scanner, with shading and noise
    LabelImage labels;  ///< 1 in the organ
    LabelImage fixed_mask;  ///< 1 in the layer over the lower surface that the scenes fix
};

/// Samples the phantom (phantom_shape.hpp) on a grid of `spacing` metres that leaves about 18 mm
/// around the organ. `seed`: of the noise; the same seed gives the same values.
PhantomImages make_phantom_images(double spacing, std::uint64_t seed);

}  // namespace livetet
