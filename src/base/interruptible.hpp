#pragma once

#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <ctime>

namespace livetet {

/// Set by the first Ctrl-C (or SIGTERM, or SIGHUP: the terminal is gone) while something is
/// Interruptible.
inline std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);

/// While it lives, what asks a program to end goes to `handler` instead. SIGHUP that was ignored
/// before (nohup) still is; Ctrl-C that was (a shell's background job) is not: it is how a run is
/// ended.
class EndSignals {
  public:
    explicit EndSignals(void (*handler)(int)) {
        for (std::size_t i = 0; i < signals.size(); ++i) {
            before_[i] = std::signal(signals[i], handler);
            if (before_[i] == SIG_IGN && signals[i] == SIGHUP) std::signal(SIGHUP, SIG_IGN);
        }
    }
    ~EndSignals() {
        if (kept_) return;
        for (std::size_t i = 0; i < signals.size(); ++i) std::signal(signals[i], before_[i]);
    }
    EndSignals(const EndSignals&) = delete;
    EndSignals& operator=(const EndSignals&) = delete;
    /// The handler stays when this is gone.
    void keep() { kept_ = true; }

    static constexpr std::array signals{SIGINT, SIGTERM, SIGHUP};

  private:
    std::array<void (*)(int), signals.size()> before_;
    bool kept_ = false;
};

/// While it lives, these signals end the run as its end would; one more, a second later, ends the
/// program (a shell or a wrapper may send the first one twice). Who read the run's messages may go:
/// that ends nothing. It is to live until what the run leaves is written.
class Interruptible {
  public:
    Interruptible() : signals_(stop), before_of_pipe_(std::signal(SIGPIPE, SIG_IGN)) {
        stop_asked = false;
    }
    /// Once a stop was asked for, the program ends: a doubled signal still does no harm.
    ~Interruptible() {
        std::signal(SIGPIPE, before_of_pipe_);
        if (stop_asked) signals_.keep();
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

    EndSignals signals_;
    void (*before_of_pipe_)(int);
};

}  // namespace livetet
