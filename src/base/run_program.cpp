#include "base/run_program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <thread>

#include "base/error.hpp"
#include "base/stop_signals.hpp"
#include "base/stopwatch.hpp"

extern char** environ;

namespace livetet {

namespace {

std::atomic<int> asked{0};  ///< the last signal that came and was not passed on yet
static_assert(std::atomic<int>::is_always_lock_free);

/// Starts it in a process group of its own, where signals reach all of it and a terminal's none.
pid_t start(const std::string& command, const std::filesystem::path& log) {
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    sigset_t usual;
    sigemptyset(&usual);
    for (const int s : EndSignals::signals)
        if (s != SIGHUP) sigaddset(&usual, s);  // under nohup that stays ignored
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, 1, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    posix_spawn_file_actions_adddup2(&files, 1, 2);
    posix_spawn_file_actions_addclosefrom_np(&files, 3);
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
    posix_spawnattr_setsigdefault(&attributes, &usual);
    std::string shell = "sh", option = "-c", text = command;
    char* words[] = {shell.data(), option.data(), text.data(), nullptr};
    pid_t child = 0;
    const int failure = posix_spawnp(&child, "sh", &files, &attributes, words, environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    if (failure != 0)
        fail("{}: cannot be started: {}", command, std::generic_category().message(failure));
    return child;
}

}  // namespace

int run_program(const std::string& command, const std::filesystem::path& log,
                std::optional<double> time_limit_s) {
    constexpr std::chrono::milliseconds pause(5);
    constexpr double doubled_s = 1;  // a shell or a wrapper may send a signal twice
    asked = 0;
    const EndSignals noted([](int which) { asked = which; });
    ::prctl(PR_SET_CHILD_SUBREAPER,
            1);  // the shell may end before what it started does, whose parent this then is
    const pid_t child = start(command, log);
    int status = 0, first = 0;
    bool timed_out = false;
    const auto began = std::chrono::steady_clock::now();
    std::chrono::steady_clock::time_point since;
    for (;;) {
        int how = 0;
        const pid_t ended = ::waitpid(-child, &how, WNOHANG);
        if (ended < 0 && errno == ECHILD) break;  // none of the group is left
        if (ended == child) status = how;
        if (ended > 0) continue;
        if (const int which = asked.exchange(0); which != 0 && first == 0) {
            first = which;
            since = std::chrono::steady_clock::now();
            ::kill(-child, which);
        } else if (which != 0 && seconds_since(since) > doubled_s) {
            ::kill(-child, SIGKILL);
        }
        if (time_limit_s && !timed_out && seconds_since(began) > *time_limit_s) {
            timed_out = true;
            ::kill(-child, SIGKILL);
        }
        std::this_thread::sleep_for(pause);
    }
    if (first != 0) throw Interrupted{first};
    if (timed_out) fail("took longer than {:g} s", *time_limit_s);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace livetet
