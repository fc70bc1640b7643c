#pragma once

#include <string>

#include "image/image.hpp"

namespace livetet {

/// Why an image of integers looks like a grey image instead of a label map: a negative voxel, or
/// more than 200 distinct values (anatomical label maps have fewer tissues, 8-bit grey images more
/// values). Empty if it looks like a label map.
std::string why_no_label_map(const LabelImage& image);

}  // namespace livetet
