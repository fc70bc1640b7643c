#ifdef LIVETET_IMAGES
#include "apps/viewer/text_layout.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace livetet {
namespace {

TEST(TextLayout, OnlyWindowsBelowTheUsualSizeHaveSmallerTexts) {
    for (const std::array<int, 2> size : {std::array{640, 400}, {1280, 800}, {8000, 400}}) {
        EXPECT_EQ(text_layout(size).scale, 1);
        EXPECT_EQ(text_layout(size).font_size(13), 13);
        EXPECT_FALSE(text_layout(size).is_small);
    }
    EXPECT_DOUBLE_EQ(text_layout({512, 400}).scale, 0.8);
    EXPECT_FALSE(text_layout({512, 400}).is_small);
    EXPECT_DOUBLE_EQ(text_layout({300, 300}).scale, 0.7);
    EXPECT_EQ(text_layout({300, 300}).font_size(13), 9);
    EXPECT_TRUE(text_layout({300, 300}).is_small);
    EXPECT_TRUE(text_layout({1280, 200}).is_small);
}

TEST(TextLayout, LabelsThatDoNotOverlapStay) {
    std::vector<LabelBox> labels{{0, 0, 50, 10}, {50, 0, 50, 10}, {0, 10, 50, 10}};
    spread_labels(labels, std::vector<LabelBox>{{100, 0, 50, 10}});
    EXPECT_EQ(labels[0].bottom, 0);
    EXPECT_EQ(labels[1].bottom, 0);
    EXPECT_EQ(labels[2].bottom, 10);
}

TEST(TextLayout, LabelsMoveUpPastThoseBeforeThemAndThoseThatAreTaken) {
    std::vector<LabelBox> labels{{0, 0, 50, 10}, {20, 3, 50, 10}, {40, -2, 50, 10}, {0, 0, 50, 10}};
    spread_labels(labels, std::vector<LabelBox>{{0, 15, 30, 10}});
    EXPECT_EQ(labels[0].bottom, 0) << "the first stays";
    EXPECT_EQ(labels[1].bottom, 25) << "above the first, it meets what is taken";
    EXPECT_EQ(labels[2].bottom, 10);
    EXPECT_EQ(labels[3].bottom, 35) << "above all";
    for (const LabelBox& label : labels) EXPECT_EQ(label.width, 50) << "moves up alone";
}

TEST(TextLayout, ManyLabelsOfOnePlaceAreAColumn) {
    std::vector<LabelBox> labels(20, {5, 5, 60, 12});
    spread_labels(labels, {});
    for (std::size_t i = 0; i < labels.size(); ++i)
        EXPECT_DOUBLE_EQ(labels[i].bottom, 5 + 12.0 * static_cast<double>(i));
}

}  // namespace
}  // namespace livetet
#endif
