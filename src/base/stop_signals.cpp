#include "base/stop_signals.hpp"

#include <atomic>
#include <ctime>

namespace livetet {

namespace {

// A handler gets no argument but the signal, so it acts on these. The source is never destroyed:
// the handler of a stopped run stays installed until the process ends.
StopSource& handled = *new StopSource;
std::atomic<std::time_t> first_signal_s{0};

void request_stop(int signal) {
    const std::time_t now_s = std::time(nullptr);
    if (!handled.request_stop()) first_signal_s = now_s;
    if (now_s - first_signal_s <= 1) return;
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

}  // namespace

EndSignals::EndSignals(void (*handler)(int)) {
    for (std::size_t i = 0; i < signals.size(); ++i) {
        before_[i] = std::signal(signals[i], handler);
        if (before_[i] == SIG_IGN && signals[i] == SIGHUP) std::signal(SIGHUP, SIG_IGN);
    }
}

EndSignals::~EndSignals() {
    if (kept_) return;
    for (std::size_t i = 0; i < signals.size(); ++i) std::signal(signals[i], before_[i]);
}

StopSignals::StopSignals()
    : signals_((handled = source_, request_stop)), pipe_before_(std::signal(SIGPIPE, SIG_IGN)) {}

StopSignals::~StopSignals() {
    std::signal(SIGPIPE, pipe_before_);
    if (token().stop_requested()) signals_.keep();
}

}  // namespace livetet
