#include "io/parse_in_child.hpp"

#include <sys/resource.h>

#include <cstring>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace livetet
