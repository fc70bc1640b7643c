#include "base/temporary_files.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>

namespace livetet {

namespace {

enum Use { unused, taken, ready };

struct Place {
    std::atomic<int> use{unused};
    char path[PATH_MAX];
};

std::array<Place, 64> places;
static_assert(std::atomic<int>::is_always_lock_free);  // required in a signal handler
volatile sig_atomic_t owner = 0;  ///< the process that cleans up; forked children do not

/// Calls async-signal-safe functions only (POSIX 2.4.3). Files are unlinked; folders are removed by
/// a child process.
void clean_up_and_end(int which) {
    std::signal(which, SIG_DFL);
    if (::getpid() == owner) {
        char remove[] = "rm", options[] = "-rf", end[] = "--";
        std::array<char*, places.size() + 4> words{remove, options, end};
        std::size_t count = 3;
        for (Place& place : places)
            if (place.use == ready && ::unlink(place.path) != 0 &&
                (errno == EISDIR || errno == EPERM))
                words[count++] = place.path;
        if (count > 3) {
            // Not fork: it would wait for malloc's lock, which the interrupted thread may hold.
            const pid_t child = ::_Fork();
            if (child == 0) {
                ::execv("/bin/rm", words.data());
                ::_exit(1);
            }
            if (child > 0) ::waitpid(child, nullptr, 0);
        }
    }
    sigset_t mask;  // the signal is blocked while its handler runs
    sigemptyset(&mask);
    sigaddset(&mask, which);
    std::raise(which);
    ::sigprocmask(SIG_UNBLOCK, &mask, nullptr);
    ::_exit(128 + which);  // process 1 of a container survives its own signal
}

}  // namespace

TemporaryPath::TemporaryPath(const std::filesystem::path& path) : place_(-1) {
    std::error_code error;
    const std::string name = std::filesystem::absolute(path, error).string();
    if (error || name.size() >= PATH_MAX) return;
    for (std::size_t i = 0; i < places.size() && place_ < 0; ++i) {
        int is = unused;
        if (!places[i].use.compare_exchange_strong(is, taken)) continue;
        std::memcpy(places[i].path, name.c_str(), name.size() + 1);
        places[i].use = ready;
        place_ = static_cast<int>(i);
    }
}

TemporaryPath::~TemporaryPath() {
    if (place_ >= 0) places[place_].use = unused;
}

void remove_temporary_files_at_signals() {
    owner = ::getpid();
    for (const int which : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) {
        struct sigaction now;
        if (::sigaction(which, nullptr, &now) == 0 && now.sa_handler == SIG_DFL)
            std::signal(which, clean_up_and_end);
    }
}

}  // namespace livetet
