#include "base/progress.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

namespace livetet {
namespace {

/// What a test prints to stderr, which is no terminal.
template <class Print>
std::string printed(Print&& print) {
    testing::internal::CaptureStderr();
    print();
    return testing::internal::GetCapturedStderr();
}

auto lines_of(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

TEST(ProgressLine, ALogGetsALineForEveryTenPerCentWithTheTimeOfDay) {
    const std::string text = printed([] {
        ProgressLine line("solve", std::chrono::hours(1));
        for (int k = 0; k <= 100; ++k) line.update(k / 100.0, "step");
    });
    EXPECT_EQ(lines_of(text), 11) << text;
    EXPECT_TRUE(std::regex_search(text, std::regex("^\\d\\d:\\d\\d:\\d\\d solve   0 % step\n")));
}

TEST(ProgressLine, ALogIsNotSilentForLongerThanStated) {
    const auto updates = [](ProgressLine::Clock::duration longest_silence) {
        return printed([&] {
            ProgressLine line("solve", longest_silence);
            for (int k = 0; k < 5; ++k) line.update(0.5, "iteration");
        });
    };
    EXPECT_EQ(lines_of(updates(ProgressLine::Clock::duration::zero())), 5);
    EXPECT_EQ(lines_of(updates(std::chrono::hours(1))), 1);
}

}  // namespace
}  // namespace livetet
