#include "base/child_process.hpp"

#include <gtest/gtest.h>

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <vector>

namespace livetet {
namespace {

using End = ChildResult::End;

TEST(ChildProcess, hands_back_its_result_and_what_it_printed) {
    const std::vector<char> sent(3'000'000, 'x');  // more than a pipe can buffer
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

TEST(ChildProcess, may_be_given_all_the_time_there_is) {
    for (const double seconds : {1e10, 1e300})
        EXPECT_EQ(run_in_child([](int) { return 0; }, seconds).end, End::returned);
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
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);  // no child is left
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

TEST(ChildProcess, has_no_more_memory_and_disk_than_it_is_given) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "the sanitizer's allocator ends the process where memory is short";
#endif
    constexpr std::uint64_t limit = 64 << 20;
    const auto taking = [](std::uint64_t bytes) {
        return [bytes](int) {
            limit_memory(limit);
            const std::vector<char> memory(bytes, 'x');
            return memory.back() == 'x' ? 0 : 1;
        };
    };
    EXPECT_EQ(run_in_child(taking(limit / 2), 20).end, End::returned);
    const ChildResult greedy = run_in_child(taking(2 * limit), 20);
    EXPECT_EQ(greedy.end, End::failed);
    EXPECT_EQ(describe_end(greedy, 20), "failed: Error   : std::bad_alloc");
    const ChildResult chatty = run_in_child(
        [](int) {
            limit_memory(1 << 20);
            for (;;) std::puts("no end of words");
            return 0;
        },
        5);
    EXPECT_EQ(chatty.end, End::crashed);
    EXPECT_EQ(chatty.detail, SIGXFSZ);
    EXPECT_EQ(chatty.log.size(), 65536u) << "the last of the MB";
    EXPECT_EQ(last_error_lines(chatty.log).substr(0, 15), "no end of words");
}

}  // namespace
}  // namespace livetet
