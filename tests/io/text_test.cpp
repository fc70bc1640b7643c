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

}  // namespace
}  // namespace livetet
