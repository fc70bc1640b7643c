#pragma once

#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <ctime>

namespace livetet {

/// Set by the first Ctrl-C (or SIGTERM, or SIGHUP: the terminal is gone) while something is Interruptible.
inline std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);

/// While it lives, these signals end the run as its end would; one more, a second later, ends the program (a shell
/// or a wrapper may send the first one twice). It is to live until what the run leaves is written. SIGHUP that
/// was ignored before (nohup) still is; Ctrl-C that was (a shell's background job) is not: it is how a run is ended.
class Interruptible {
  public:
    Interruptible() {
        stop_asked = false;
        for (std::size_t i = 0; i < signals.size(); ++i) {
            before_[i] = std::signal(signals[i], stop);
            if (before_[i] == SIG_IGN && signals[i] == SIGHUP) std::signal(SIGHUP, SIG_IGN);
        }
    }
    /// Once a stop was asked for, the program ends: a doubled signal still does no harm.
    ~Interruptible() {
        if (stop_asked) return;
        for (std::size_t i = 0; i < signals.size(); ++i) std::signal(signals[i], before_[i]);
    }
    Interruptible(const Interruptible&) = delete;
    Interruptible& operator=(const Interruptible&) = delete;

  private:
    static constexpr std::array signals{SIGINT, SIGTERM, SIGHUP};

    static void stop(int which) {
        static std::atomic<std::time_t> asked_s{0};
        const std::time_t now_s = std::time(nullptr);
        if (!stop_asked.exchange(true)) asked_s = now_s;
        if (now_s - asked_s <= 1) return;
        std::signal(which, SIG_DFL);
        std::raise(which);
    }

    std::array<void (*)(int), signals.size()> before_;
};

}  // namespace livetet
