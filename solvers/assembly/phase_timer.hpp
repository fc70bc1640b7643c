#pragma once

#include <malloc.h>

#include <chrono>

#include "base/stopwatch.hpp"

namespace livetet {

/// Cost of one part of a body on this rank: heap memory, time, and how often it was computed.
struct PhaseCost {
    double bytes = 0, seconds = 0;
    long times = 0;

    PhaseCost& operator+=(const PhaseCost& other) {
        bytes += other.bytes;
        seconds += other.seconds;
        times += other.times;
        return *this;
    }
};

/// Counts one time, and what passes until the timer is gone.
class PhaseTimer {
  public:
    explicit PhaseTimer(PhaseCost& part) : part_(part) { ++part_.times; }
    ~PhaseTimer() { part_.seconds += seconds_since(start_); }
    PhaseTimer(const PhaseTimer&) = delete;
    PhaseTimer& operator=(const PhaseTimer&) = delete;

  private:
    PhaseCost& part_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Adds what the heap grows by until the guard is gone; nothing for a null part. Asks the whole
/// heap, under its locks: for set-up, not for frames.
class HeapGrowth {
  public:
    explicit HeapGrowth(PhaseCost* part) : part_(part), before_(part ? heap() : 0) {}
    ~HeapGrowth() {
        if (part_) part_->bytes += heap() - before_;
    }
    HeapGrowth(const HeapGrowth&) = delete;
    HeapGrowth& operator=(const HeapGrowth&) = delete;

  private:
    static double heap() {
        const struct mallinfo2 m = mallinfo2();
        return static_cast<double>(m.uordblks) + static_cast<double>(m.hblkhd);
    }
    PhaseCost* part_;
    double before_;
};

}  // namespace livetet
