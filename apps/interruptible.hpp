#pragma once

#include <atomic>
#include <csignal>
#include <ctime>

namespace livetet {

/// Set by the first Ctrl-C (or SIGTERM) while something is Interruptible.
inline std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);

/// While it lives, Ctrl-C (and SIGTERM) ends the run as its end would; one more, a second later, ends the program (a shell
/// or a wrapper may send the first one twice).
class Interruptible {
  public:
    Interruptible() {
        stop_asked = false;
        for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, stop);
    }
    ~Interruptible() {
        for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
    }
    Interruptible(const Interruptible&) = delete;
    Interruptible& operator=(const Interruptible&) = delete;

  private:
    static void stop(int which) {
        static std::atomic<std::time_t> asked_s{0};
        const std::time_t now_s = std::time(nullptr);
        if (!stop_asked.exchange(true)) asked_s = now_s;
        if (now_s - asked_s <= 1) return;
        std::signal(which, SIG_DFL);
        std::raise(which);
    }
};

}  // namespace livetet
