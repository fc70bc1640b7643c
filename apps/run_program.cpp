#include "apps/run_program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <thread>

#include "base/error.hpp"
#include "base/stopwatch.hpp"

extern char** environ;

namespace livetet {

namespace {

std::atomic<int> asked{0};  ///< the last signal that came and was not passed on yet
static_assert(std::atomic<int>::is_always_lock_free);

/// While it lives, what asks this program to end is noted instead. SIGHUP that is ignored (nohup) still is.
class Noting {
  public:
    Noting() {
        asked = 0;
        for (std::size_t i = 0; i < signals.size(); ++i) {
            before_[i] = std::signal(signals[i], [](int which) { asked = which; });
            if (signals[i] == SIGHUP && before_[i] == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
        }
    }
    ~Noting() {
        for (std::size_t i = 0; i < signals.size(); ++i) std::signal(signals[i], before_[i]);
    }
    Noting(const Noting&) = delete;
    Noting& operator=(const Noting&) = delete;

  private:
    static constexpr std::array signals{SIGINT, SIGTERM, SIGHUP};
    std::array<void (*)(int), signals.size()> before_;
};

/// Starts it in a process group of its own, where signals reach all of it and a terminal's none.
pid_t start(const std::string& command, const std::filesystem::path& log) {
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    sigset_t usual;
    sigemptyset(&usual);
    for (const int s : {SIGINT, SIGTERM}) sigaddset(&usual, s);
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, 1, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    posix_spawn_file_actions_adddup2(&files, 1, 2);
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
    posix_spawnattr_setsigdefault(&attributes, &usual);
    std::string shell = "sh", option = "-c", text = command;
    char* words[] = {shell.data(), option.data(), text.data(), nullptr};
    pid_t child = 0;
    const int failure = posix_spawnp(&child, "sh", &files, &attributes, words, environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    if (failure != 0) fail("{}: cannot be started: {}", command, std::generic_category().message(failure));
    return child;
}

}  // namespace

int run_program(const std::string& command, const std::filesystem::path& log) {
    constexpr std::chrono::milliseconds pause(5);
    constexpr double doubled_s = 1;  // a shell or a wrapper may send a signal twice
    const Noting noting;
    const pid_t child = start(command, log);
    int status = 0, first = 0;
    std::chrono::steady_clock::time_point since;
    for (pid_t ended = 0; (ended = ::waitpid(child, &status, WNOHANG)) != child; std::this_thread::sleep_for(pause)) {
        if (ended < 0 && errno != EINTR) fail("{}: is lost: {}", command, std::generic_category().message(errno));
        const int which = asked.exchange(0);
        if (which == 0) continue;
        if (first == 0) {
            first = which;
            since = std::chrono::steady_clock::now();
            ::kill(-child, which);
        } else if (seconds_since(since) > doubled_s) {
            ::kill(-child, SIGKILL);
        }
    }
    if (first != 0) throw Interrupted{first};
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace livetet
