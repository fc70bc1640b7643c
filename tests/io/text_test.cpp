#include "io/text.hpp"

#include <gtest/gtest.h>

namespace livetet {
namespace {

TEST(Text, TheFirstDifferenceIsOfLinesThatStandInEachOthersPlace) {
    const std::string scene = "mesh: a.h5\nfix: all\nsolver:\n  kind: live\n";
    EXPECT_EQ(first_difference(scene, "mesh: a.h5\nfix: none\nsolver:\n  kind: live\n"),
              R"(was "fix: all", is "fix: none")");
    EXPECT_EQ(first_difference(scene, "mesh: a.h5\nfix: all\ngravity: 1\nsolver:\n  kind: live\n"),
              R"(was nothing, is "gravity: 1")");
    EXPECT_EQ(first_difference(scene, "mesh: a.h5\nfix: all\n"), R"(was "solver:", is nothing)");
    EXPECT_EQ(first_difference("a\na\n", "a\n"), R"(was "a", is nothing)");
    EXPECT_EQ(first_difference("", "a\r\n"), R"(was nothing, is "a")");
    EXPECT_EQ(first_difference(scene, scene), "was nothing, is nothing");
}

TEST(Text, IsPrintableWithoutControlsAndInvalidBytes) {
    const auto printable = [](std::string_view text) { return printable_text(text, 64); };
    EXPECT_EQ(printable("Liver, left"), "Liver, left");
    EXPECT_EQ(printable("Läsion 肝臓 🫀"), "Läsion 肝臓 🫀");
    EXPECT_EQ(printable("a\x1b[31mb\n\x7f"), "a?[31mb??");
    EXPECT_EQ(printable("\xc2\x9b"
                        "2J\xc2\xa9"),
              "?2J\xc2\xa9");                          // CSI, then a sign
    EXPECT_EQ(printable("L\xe4sion"), "L?sion");       // Latin-1
    EXPECT_EQ(printable("\xc0\xaf"), "??");            // overlong
    EXPECT_EQ(printable("\xed\xa0\x80"), "???");       // a surrogate
    EXPECT_EQ(printable("\xf4\x90\x80\x80"), "????");  // above U+10FFFF
    EXPECT_EQ(printable("\xe8\x82"), "??");            // cut short
    EXPECT_EQ(printable_text("aä", 2), "a");
    EXPECT_EQ(printable_text("aä", 3), "aä");
    EXPECT_EQ(printable_text("", 3), "");
}

}  // namespace
}  // namespace livetet
