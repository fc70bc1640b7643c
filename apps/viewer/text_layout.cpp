#include "apps/viewer/text_layout.hpp"

#include <algorithm>
#include <cmath>

namespace livetet {

namespace {

bool overlap(const LabelBox& a, const LabelBox& b) {
    return a.left < b.left + b.width && b.left < a.left + a.width &&
           a.bottom < b.bottom + b.height && b.bottom < a.bottom + a.height;
}

}  // namespace

int TextLayout::font_size(int pixels) const {
    return static_cast<int>(std::lround(scale * pixels));
}

TextLayout text_layout(std::array<int, 2> size) {
    constexpr double usual_width = 640, usual_height = 400, min_scale = 0.7;
    const double room = std::min(size[0] / usual_width, size[1] / usual_height);
    return {std::clamp(room, min_scale, 1.0), room < min_scale};
}

void spread_labels(std::span<LabelBox> labels, std::span<const LabelBox> taken) {
    for (std::size_t i = 0; i < labels.size(); ++i) {
        LabelBox& label = labels[i];
        const auto give_way = [&](std::span<const LabelBox> others) {
            bool moved = false;
            for (const LabelBox& other : others)
                if (overlap(label, other)) {
                    label.bottom = other.bottom + other.height;
                    moved = true;
                }
            return moved;
        };
        // Each round moves it up, past at least one of finitely many boxes.
        while (give_way(taken) || give_way(labels.first(i))) continue;
    }
}

}  // namespace livetet
