#pragma once

#include <chrono>

namespace livetet {

using Clock = std::chrono::steady_clock;

/// A moment by which work is to end. Time is read by a function of its own, so that a test can
/// have its own clock.
class Deadline {
  public:
    using ReadClock = Clock::time_point (*)();

    Deadline(Clock::time_point at, ReadClock read = &Clock::now) : at_(at), read_(read) {}
    /// So many seconds after `start`.
    static Deadline after(Clock::time_point start, double seconds, ReadClock read = &Clock::now) {
        return {start + duration(seconds), read};
    }

    Clock::time_point now() const { return read_(); }
    /// Seconds until it; negative once it has passed.
    double left_s() const { return left_s(now()); }
    /// The same from `from` on.
    double left_s(Clock::time_point from) const {
        return std::chrono::duration<double>(at_ - from).count();
    }
    Deadline earlier_by(double seconds) const { return {at_ - duration(seconds), read_}; }

  private:
    static Clock::duration duration(double seconds) {
        return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    }

    Clock::time_point at_;
    ReadClock read_;
};

}  // namespace livetet
