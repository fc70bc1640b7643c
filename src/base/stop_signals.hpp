#pragma once

#include <array>
#include <csignal>
#include <cstddef>

#include "base/stop_token.hpp"

namespace livetet {

/// While it lives, the signals that ask a program to end go to `handler`. A SIGHUP that was ignored
/// before (nohup) stays ignored. A SIGINT that was ignored (a shell's background job) does not:
/// SIGINT is how a run is ended.
class EndSignals {
  public:
    explicit EndSignals(void (*handler)(int));
    /// Restores the handlers of before, unless `keep` was called.
    ~EndSignals();
    EndSignals(const EndSignals&) = delete;
    EndSignals& operator=(const EndSignals&) = delete;
    /// Leaves the handler installed after this object is gone.
    void keep() { kept_ = true; }

    static constexpr std::array signals{SIGINT, SIGTERM, SIGHUP};

  private:
    std::array<void (*)(int), signals.size()> before_;
    bool kept_ = false;
};

/// While it lives, SIGINT, SIGTERM and SIGHUP request a stop of its source instead of ending the
/// program. One more signal, at least a second later, ends the program (a shell or a wrapper may
/// send the first one twice). SIGPIPE is ignored: the run goes on when whoever reads its messages
/// is gone. Made by a command, which keeps it until its results are written; one at a time.
class StopSignals {
  public:
    StopSignals();
    /// After a stop was requested the program is about to end: the handlers stay, so that a second
    /// signal right behind the first does no harm.
    ~StopSignals();
    StopSignals(const StopSignals&) = delete;
    StopSignals& operator=(const StopSignals&) = delete;

    const StopSource& source() const { return source_; }
    StopToken token() const { return source_.token(); }

  private:
    StopSource source_;
    EndSignals signals_;
    void (*pipe_before_)(int);
};

}  // namespace livetet
