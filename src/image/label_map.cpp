#include "image/label_map.hpp"

#include <fmt/format.h>

#include <unordered_set>

namespace livetet {

std::string why_no_label_map(const LabelImage& image) {
    constexpr std::size_t max_labels = 200;
    std::unordered_set<std::int32_t> values;
    for (std::size_t n = 0; n < image.values.size(); ++n) {
        if (n > 0 && image.values[n] == image.values[n - 1]) continue;
        values.insert(image.values[n]);
        if (image.values[n] < 0) return fmt::format("a voxel is {}", image.values[n]);
        if (values.size() > max_labels)
            return fmt::format("more than {} different values", max_labels);
    }
    return {};
}

}  // namespace livetet
