#pragma once

#include <string>

#include "image/image.hpp"

namespace livetet {

/// Why an image of whole numbers looks like a grey image and not like a label map: a voxel is
/// negative, or there are more than 200 different values (anatomical label maps name fewer tissues,
/// 8-bit grey images have more values). Empty where it looks like a label map.
std::string why_no_label_map(const LabelImage& image);

}  // namespace livetet
