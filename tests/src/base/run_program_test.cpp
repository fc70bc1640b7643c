#include "base/run_program.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <sstream>

#include "base/error.hpp"

namespace livetet {
namespace {

/// The program that is run shows what it holds: nothing but its three standard descriptors.
TEST(RunProgram, TheProgramInheritsNoDescriptor) {
    const auto log =
        std::filesystem::temp_directory_path() / fmt::format("livetet_run_program_{}", ::getpid());
    const int descriptor = ::open("/dev/null", O_RDONLY);  // without O_CLOEXEC
    ASSERT_GE(descriptor, 3);
    EXPECT_EQ(run_program(
                  "for f in /proc/self/fd/[0-9]*; do [ -e $f ] && echo ${f##*/}; done; true", log),
              0);
    ::close(descriptor);
    std::ifstream file(log);
    std::stringstream text;
    text << file.rdbuf();
    std::filesystem::remove(log);
    EXPECT_EQ(text.str(), "0\n1\n2\n");
}

TEST(RunProgram, ATimeLimitEndsAllOfIt) {
    const auto log = std::filesystem::path(testing::TempDir()) / "limited.log";
    const auto began = std::chrono::steady_clock::now();
    EXPECT_THROW((void)run_program("sleep 60 & sleep 60", log, 0.3), Error);
    EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(20));
    EXPECT_EQ(run_program("exit 4", log, 30), 4);
    std::filesystem::remove(log);
}

}  // namespace
}  // namespace livetet
