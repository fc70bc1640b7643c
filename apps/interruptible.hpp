#pragma once

#include <atomic>
#include <csignal>

namespace livetet {

/// Set by the first Ctrl-C (or SIGTERM) while something is Interruptible.
inline std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);

/// While it lives, Ctrl-C (and SIGTERM) ends the run as its end would; a second one ends the program.
class Interruptible {
  public:
    Interruptible() {
        stop_asked = false;
        for (const int signal : {SIGINT, SIGTERM})
            std::signal(signal, [](int which) {
                stop_asked = true;
                std::signal(which, SIG_DFL);
            });
    }
    ~Interruptible() {
        for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
    }
    Interruptible(const Interruptible&) = delete;
    Interruptible& operator=(const Interruptible&) = delete;
};

}  // namespace livetet
