#include "config/markdown.hpp"

#include <gtest/gtest.h>

#include "tracking/motion_script.hpp"

namespace livetet {
namespace {

bool has(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

TEST(Markdown, EscapesWhatWouldEndACell) {
    EXPECT_EQ(markdown_row({"a|b", ""}), "| a|b | |\n");
    EXPECT_EQ(markdown_cell("displacement|stress <b>\nnext"), "displacement\\|stress &lt;b> next");
}

TEST(Markdown, AKeyHasDefaultUnitMeaningAndLimit) {
    const std::string text = markdown_of<MotionScript>();
    EXPECT_TRUE(has(text, "| `rate_Hz` | `20` | Hz | "));
    EXPECT_TRUE(has(text, "; must be greater than 0 |"));
}

TEST(Markdown, NestedTablesAreSectionsThatTheirKeysLinkTo) {
    const std::string text = markdown_of<MotionScript>();
    EXPECT_TRUE(has(text, "| [`organ`](#organ) | a table | |"));
    EXPECT_TRUE(has(text, "| [`moves`](#organmoves) | a list of tables | |"));
    EXPECT_TRUE(has(text, "\n## organ.moves\n"));
    EXPECT_LT(text.find("\n## organ\n"), text.find("\n## organ.moves\n"));
    EXPECT_LT(text.find("\n## organ.moves\n"), text.find("\n## tools\n"));
}

TEST(Markdown, AChoiceListsItsNamesAndMeanings) {
    const std::string text = markdown_of<MotionScript>();
    EXPECT_TRUE(has(text, "| `on` | `organ` | |"));
    EXPECT_TRUE(has(text, "<br>`tracker`: "));
}

}  // namespace
}  // namespace livetet
