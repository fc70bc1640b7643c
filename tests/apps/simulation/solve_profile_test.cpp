#include "apps/simulation/solve_profile.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace livetet {
namespace {

const ProfileRow rows[] = {
    {.part = "matrix",
     .cost = {.bytes = 2.5e6, .seconds = 0.125, .times = 3},
     .is_built = true,
     .why = {}},
    {.part = "forces", .cost = {.seconds = 0.5}, .is_built = true, .why = {}},
    {.part = "mass", .cost = {.bytes = 1e9}, .is_built = false, .why = "time.scheme: static"},
};

TEST(SolveProfile, TheTableLinesUpAndSaysWhyAPartIsLeftOut) {
    const std::string text = profile_table(rows);
    EXPECT_NE(text.find("part                    MB     times    seconds\n"), text.npos) << text;
    EXPECT_NE(text.find("matrix                2.50         3     0.1250\n"), text.npos) << text;
    // What was not measured is blank, not zero.
    EXPECT_NE(text.find("forces                                   0.5000\n"), text.npos) << text;
    EXPECT_NE(text.find("mass             left out: time.scheme: static\n"), text.npos) << text;
}

TEST(SolveProfile, TheJsonHasEveryRow) {
    const nlohmann::json list = json_of(rows);
    ASSERT_EQ(list.size(), std::size(rows));
    EXPECT_EQ(list[0].at("part"), "matrix");
    EXPECT_EQ(list[0].at("bytes"), 2.5e6);
    EXPECT_EQ(list[0].at("times"), 3);
    EXPECT_EQ(list[0].at("built"), true);
    EXPECT_EQ(list[2].at("built"), false);
}

}  // namespace
}  // namespace livetet
