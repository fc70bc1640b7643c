#pragma once

#include <array>
#include <span>

namespace livetet {

/// How texts fit a window.
struct TextLayout {
    double scale = 1;       ///< of the font sizes
    bool is_small = false;  ///< only the most important texts have room

    /// A font size in pixels, given that in a window of usual size.
    int font_size(int pixels) const;
};

/// The layout of a window of this size in pixels. Fonts shrink to 0.7 times their size below
/// 640 x 400; where that is not enough, the window is small.
TextLayout text_layout(std::array<int, 2> size);

/// The rectangle of a label, pixels.
struct LabelBox {
    double left = 0, bottom = 0, width = 0, height = 0;
};

/// Moves labels up until none overlaps another or one of `taken`. The first label gives way to
/// `taken` alone, each later one also to those before it.
void spread_labels(std::span<LabelBox> labels, std::span<const LabelBox> taken);

}  // namespace livetet
