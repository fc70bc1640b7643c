#pragma once

#include <cstdint>

#include "image/image.hpp"

namespace livetet {

/// The phantom's volume as a scanner and somebody with a brush would have given it.
struct PhantomImages {
    GreyImage
        image;  ///< grey values as of a magnetic resonance scanner, with its shading and noise
    LabelImage labels;      ///< 1 in the organ
    LabelImage fixed_mask;  ///< 1 in the layer over the lower surface that a scene holds
};

/// Samples the phantom (apps/phantom_shape.hpp) on a grid of `spacing` metres that leaves about 18
/// mm around the organ. The noise comes from `seed`: the same seed gives the same values.
PhantomImages make_phantom_images(double spacing, std::uint64_t seed);

}  // namespace livetet
