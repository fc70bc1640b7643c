#pragma once

#include <malloc.h>

#include <chrono>

#include "base/petsc.hpp"
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

/// The event of this name for PETSc's -log_view; the same number every time. PETSc is initialised.
inline PetscLogEvent log_event(const char* name) {
    PetscLogEvent event = -1;
    LIVETET_PETSC(PetscLogEventGetId(name, &event));
    if (event >= 0) return event;
    PetscClassId of_livetet = 0;
    LIVETET_PETSC(PetscClassIdRegister("Livetet", &of_livetet));
    LIVETET_PETSC(PetscLogEventRegister(name, of_livetet, &event));
    return event;
}

/// Adds one computation of a part, and its time until the timer is destroyed, to the part's cost
/// and to PETSc's log. PETSc's events alone would not suffice: they know no memory and record only
/// under -log_view.
class PhaseTimer {
  public:
    PhaseTimer(PhaseCost& part, PetscLogEvent event) : part_(part), event_(event) {
        ++part_.times;
        PetscLogEventBegin(event_, 0, 0, 0, 0);
    }
    ~PhaseTimer() {
        PetscLogEventEnd(event_, 0, 0, 0, 0);
        part_.seconds += seconds_since(start_);
    }
    PhaseTimer(const PhaseTimer&) = delete;
    PhaseTimer& operator=(const PhaseTimer&) = delete;

  private:
    PhaseCost& part_;
    PetscLogEvent event_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Adds what the heap grows by until the guard is gone; nothing for a null part. Asks the whole
/// heap, under its locks: for set-up, not for frames.
class HeapMeter {
  public:
    explicit HeapMeter(PhaseCost* part) : part_(part), before_(part ? heap() : 0) {}
    ~HeapMeter() {
        if (part_) part_->bytes += heap() - before_;
    }
    HeapMeter(const HeapMeter&) = delete;
    HeapMeter& operator=(const HeapMeter&) = delete;

  private:
    static double heap() {
        const struct mallinfo2 m = mallinfo2();
        return static_cast<double>(m.uordblks) + static_cast<double>(m.hblkhd);
    }
    PhaseCost* part_;
    double before_;
};

}  // namespace livetet
