#include "base/run_program.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

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

}  // namespace
}  // namespace livetet
