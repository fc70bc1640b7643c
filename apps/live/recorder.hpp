#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <thread>

#include "apps/live/tracked_body.hpp"
#include "base/ring.hpp"
#include "io/result_file.hpp"
#include "tracking/source.hpp"

namespace livetet {

/// A frame with the sample that it was made from and what it took.
struct KeptFrame {
    Frame frame;
    std::uint64_t sample = 0;          ///< its number
    double arrived_s = 0, done_s = 0;  ///< steady clock
    double seconds = 0;                ///< what the frame took
    bool last = false;                 ///< no frame: the end of the stream
};

/// Samples on their way from the source's thread to the recorder's.
class ArrivalLog {
  public:
    ArrivalLog();
    /// From the source's thread. Kept from when a recorder is there to write them.
    void keep(const StreamSample& sample);
    /// Samples that came while the disk was a whole ring behind.
    std::size_t not_kept() const { return not_kept_; }

  private:
    friend class Recorder;
    Ring<StreamSample> ring_;
    std::atomic<bool> wanted_{false};
    std::atomic<std::size_t> not_kept_{0};
};

/// Of the displacements as they are in memory, to the bit.
std::uint32_t checksum(std::span<const Vector3> displacement);

/// Writes frames, and the samples that came in, from a thread of its own, so that neither the
/// simulation nor the source ever waits for a disk.
class Recorder {
  public:
    /// `solver`: what computed the frames; the live one alone estimates their errors. What was
    /// written is whole on the disk every `flush_s`, should the program be killed.
    Recorder(ResultWriter& writer, SolverKind solver, ArrivalLog& arrivals, double flush_s = 3);
    ~Recorder();
    /// False where the disk is a whole ring behind, or writing has failed: the frame is not kept.
    /// From the simulation's thread.
    bool keep(const Frame& frame, const StreamSample& sample, double seconds);
    /// Whether writing has failed, which was said: nothing is kept from then on.
    bool failed() const { return failed_.load(std::memory_order_acquire); }
    /// Waits until all is written. Returns why writing failed, if it did: what was written before
    /// can still be kept.
    std::optional<std::string> close();

  private:
    void run();
    void flush_in_time();
    void write(const KeptFrame& kept);
    void write_arrivals();

    ResultWriter& writer_;
    SolverKind solver_;
    Ring<KeptFrame> ring_;
    ArrivalLog& arrivals_;
    const double flush_s_;
    double flushed_s_ = 0;  ///< when, steady clock
    std::optional<std::string> failure_;
    std::atomic<bool> failed_{false};
    std::thread thread_;
};

/// What a result holds of the samples that came in, in the order of their numbers, and of how each
/// frame was solved.
struct RecordedRun {
    struct FrameRecord {
        std::uint64_t sample = 0;
        std::array<SolveRecord, max_recorded_solves> solves{};
        std::uint32_t checksum = 0;
        std::optional<HandPull> pull{};  ///< older files hold none
    };
    std::vector<StreamSample> samples;
    std::vector<FrameRecord> frames;
};

/// Throws Error where the file does not hold them, or not together.
RecordedRun read_recorded_run(const ResultReader& reader, const std::string& source);

}  // namespace livetet
