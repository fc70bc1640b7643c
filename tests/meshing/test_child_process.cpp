#include "meshing/child_process.hpp"

#include <gtest/gtest.h>

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

namespace livetet {
namespace {

using End = ChildResult::End;

TEST(ChildProcess, hands_back_its_result_and_what_it_printed) {
    const std::vector<char> sent(3'000'000, 'x');  // more than a pipe would hold
    const ChildResult child = run_in_child(
        [&](int out) {
            std::printf("said on stdout\n");
            std::fprintf(stderr, "said on stderr\n");
            return write_all(out, sent.data(), sent.size()) ? 0 : 1;
        },
        20);
    EXPECT_EQ(child.end, End::returned);
    EXPECT_EQ(child.result, sent);
    EXPECT_NE(child.log.find("said on stdout"), std::string::npos);
    EXPECT_NE(child.log.find("said on stderr"), std::string::npos);
}

TEST(ChildProcess, is_killed_at_the_time_limit_even_if_deaf_to_SIGTERM) {
    const ChildResult child = run_in_child(
        [](int) {
            ::signal(SIGTERM, SIG_IGN);
            for (;;) ::sleep(60);
            return 0;
        },
        0.3);
    EXPECT_EQ(child.end, End::timed_out);
    EXPECT_GE(child.seconds, 0.3);
    EXPECT_LT(child.seconds, 5);
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);  // nobody left to wait for
    EXPECT_EQ(errno, ECHILD);
}

TEST(ChildProcess, tells_crash_failure_and_exception_apart) {
    ChildResult child = run_in_child([](int) -> int { std::abort(); }, 20);
    EXPECT_EQ(child.end, End::crashed);
    EXPECT_EQ(child.detail, SIGABRT);
    child = run_in_child([](int) { return 3; }, 20);
    EXPECT_EQ(child.end, End::failed);
    EXPECT_EQ(child.detail, 3);
    child = run_in_child([](int) -> int { throw std::runtime_error("no luck"); }, 20);
    EXPECT_EQ(child.end, End::failed);
    EXPECT_NE(child.log.find("Error   : no luck"), std::string::npos);
}

TEST(ChildProcess, runs_no_signal_handler_of_its_parent) {
    const auto before = ::signal(SIGABRT, [](int) { ::_exit(0); });
    const ChildResult child = run_in_child([](int) -> int { ::abort(); }, 20);
    ::signal(SIGABRT, before);
    EXPECT_EQ(child.end, End::crashed);
}

}  // namespace
}  // namespace livetet
