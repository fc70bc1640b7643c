#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apps/live/probe_history.hpp"
#include "apps/live/tracked_body.hpp"
#include "base/ring.hpp"
#include "io/result_file.hpp"
#include "tracking/source.hpp"

namespace livetet {

/// A frame, its sample and its computing time.
struct KeptFrame {
    Frame frame;
    std::uint64_t sample = 0;          ///< number of the sample
    double arrived_s = 0, done_s = 0;  ///< steady clock
    double seconds = 0;                ///< computing time
    std::uint64_t slipped = 0;         ///< slipped_sensors since the frame kept before
    bool last = false;                 ///< no frame, but the end of the stream
};

/// Received samples on their way from the source's thread to the recorder's.
class ArrivalLog {
  public:
    ArrivalLog();
    /// Called from the source's thread. Samples are dropped until a recorder exists.
    void keep(const StreamSample& sample);
    /// Number of samples lost because the ring was full.
    std::size_t not_kept() const { return not_kept_; }

  private:
    friend class Recorder;
    Ring<StreamSample> ring_;
    std::atomic<bool> wanted_{false};
    std::atomic<std::size_t> not_kept_{0};
};

/// CRC-32 of the displacements as they lie in memory.
std::uint32_t checksum(std::span<const Vector3> displacement);

/// The sensors of a frame whose patch is let go because they slipped: the sum of 2^i over the
/// indices of their tools in the samples, up to 52. A change of the scene may change the order of
/// sensors, but not that of tools.
std::uint64_t slipped_sensors(const FrameState& frame);
/// Whether the sensor of this tool is in such a sum.
bool is_slipped(std::uint64_t sum, std::size_t tool);
/// The same of a kept frame and those since the one kept before; 0 in older files. Throws Error if
/// it is no such sum.
std::uint64_t read_slipped(const ResultReader& reader, std::size_t k, const std::string& source);

/// The files of a run; nullptr: not wanted.
struct RecordedFiles {
    ResultWriter* result = nullptr;  ///< frames and received samples
    ProbeHistory* probes = nullptr;
};

/// Writes frames and received samples from a thread of its own, so that neither the simulation nor
/// the source waits for the disk.
class Recorder {
  public:
    /// `solver`: the one that computed the frames; only the live solver estimates their errors. The
    /// files are flushed every `flush_s`: a killed program loses no more than that.
    Recorder(const RecordedFiles& files, SolverKind solver, ArrivalLog& arrivals,
             double flush_s = 3);
    ~Recorder();
    /// Called from the simulation thread. Returns false if the frame is not kept: the ring is full,
    /// or writing has failed.
    bool keep(const Frame& frame, const StreamSample& sample, double seconds);
    /// Called from the simulation thread for a frame that is not to be kept. The next one that is
    /// kept tells its slips: a patch that is released at once has slipped in one frame only.
    void pass_over(const FrameState& frame);
    /// Whether writing has failed; the failure was logged, and nothing is kept any more.
    bool failed() const { return failed_.load(std::memory_order_acquire); }
    /// Waits until everything is written. Returns why writing failed, if it did: what was written
    /// before can still be used.
    std::optional<std::string> close();

  private:
    void run();
    void flush();
    void flush_in_time();
    void write(const KeptFrame& kept);
    void take_mesh(const FrameState& frame);
    void write_frame(const KeptFrame& kept);
    void write_arrivals();

    RecordedFiles files_;
    SolverKind solver_;
    Ring<KeptFrame> ring_;
    ArrivalLog& arrivals_;
    const double flush_s_;
    double flushed_s_ = 0;                ///< time of the last flush, steady clock
    std::shared_ptr<const CutMesh> cut_;  ///< FrameState::cut of the last frame written
    std::uint64_t slipped_ = 0;  ///< slipped_sensors since the last kept frame; simulation thread
    std::optional<std::string> failure_;
    std::atomic<bool> failed_{false};
    std::thread thread_;
};

/// The received samples of a result, ordered by number, and how each frame was solved.
struct RecordedRun {
    struct FrameRecord {
        std::uint64_t sample = 0;
        std::array<SolveRecord, max_recorded_solves> solves{};
        std::uint32_t checksum = 0;
        std::optional<HandPull> pull{};  ///< none in older files
        std::shared_ptr<const HandCut> cut{};
        std::optional<double> ahead_s{};  ///< as FrameState has it; none in older files
    };
    std::vector<StreamSample> samples;
    std::vector<FrameRecord> frames;
};

/// Throws Error if the file lacks samples or frames, or they do not belong together.
RecordedRun read_recorded_run(const ResultReader& reader, const std::string& source);

}  // namespace livetet
