#include "io/parse_in_child.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <fstream>

#include <gtest/gtest.h>

#include "files.hpp"

namespace livetet {
namespace {

TEST(ParseInChild, LimitsFollowTheBytesAndCanBeLowered) {
    rlimit cpu[2];
    const std::vector<char> result =
        parse_in_child("several", 1'000'000'000, "test", [&]() -> std::vector<char> {
            ::getrlimit(RLIMIT_CPU, &cpu[0]);
            limit_parser(1'000'000);
            limit_parser(2'000'000);  // an existing lower limit stays
            ::getrlimit(RLIMIT_CPU, &cpu[1]);
            const auto* first = reinterpret_cast<const char*>(cpu);
            return {first, first + sizeof cpu};
        });
    ASSERT_EQ(result.size(), sizeof cpu);
    std::memcpy(cpu, result.data(), sizeof cpu);
    EXPECT_EQ(cpu[0].rlim_cur, 2005u);
    EXPECT_EQ(cpu[1].rlim_cur, 7u);
}

TEST(ParseInChild, AReaderThatOthersKillIsStartedOnceMore) {
    const std::filesystem::path starts = testing_files::fresh_folder() / "starts";
    const auto killed = [&](std::uintmax_t times) -> std::vector<char> {
        std::ofstream(starts, std::ios::app) << 's' << std::flush;
        if (std::filesystem::file_size(starts) <= times) ::kill(::getpid(), SIGKILL);
        return {'r', 'e', 'a', 'd'};
    };
    EXPECT_EQ(parse_in_child("whole.h5", 1000, "test", [&] { return killed(1); }).size(), 4u);
    EXPECT_EQ(std::filesystem::file_size(starts), 2u);
    std::filesystem::remove(starts);
    try {
        parse_in_child("whole.h5", 1000, "test", [&] { return killed(3); });
        FAIL() << "it was read";
    } catch (const Error& error) {
        EXPECT_STREQ(error.what(),
                     "whole.h5: cannot be read: test was killed twice (signal 9), for want of "
                     "memory?");
    }
    EXPECT_EQ(std::filesystem::file_size(starts), 2u);
}

}  // namespace
}  // namespace livetet
