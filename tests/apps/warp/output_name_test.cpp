#include "apps/warp/output_name.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"

namespace livetet {
namespace {

TEST(OutputName, FramesAreChosenByRanges) {
    using Frames = std::vector<std::size_t>;
    EXPECT_EQ(chosen_frames("1:10:3", 10, "r"), (Frames{0, 3, 6, 9}));
    EXPECT_EQ(chosen_frames("2:9:3", 10, "r"), (Frames{1, 4, 7}));
    EXPECT_EQ(chosen_frames("3", 10, "r"), (Frames{2}));
    EXPECT_EQ(chosen_frames("::5, 10", 10, "r"), (Frames{0, 5, 9}));
    EXPECT_EQ(chosen_frames("9:", 10, "r"), (Frames{8, 9}));
    EXPECT_EQ(chosen_frames("::18446744073709551615", 10, "r"), (Frames{0}));
    for (const char* wrong :
         {"0", "11", "1:11", "5:4", "1:2:0", "", ",", "1,,2", "a", "1:2:3:4", "-1", "1.5"})
        EXPECT_THROW(chosen_frames(wrong, 10, "r"), Error) << wrong;
}

TEST(OutputName, WordsInBracesStandForTheResult) {
    EXPECT_EQ(output_name("-o", "{folder}/{result}_{frame}.nii", "a/b/run.h5", 4, 120),
              "a/b/run_005.nii");
    EXPECT_EQ(output_name("-o", "{folder}/x.nii", "run.h5", 4, 120), "./x.nii");
    EXPECT_THROW(output_name("-o", "x_{fraem}.nii", "run.h5", 4, 120), Error);
    EXPECT_THROW(output_name("-o", "x_{frame", "run.h5", 4, 120), Error);
}

}  // namespace
}  // namespace livetet
