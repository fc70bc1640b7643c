#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/distribution.hpp"

namespace livetet {

/// What a thread had of its cores during an interval.
struct CoreUse {
    double cpu_s = 0;             ///< CPU time of the thread
    long blocked = 0;             ///< its voluntary context switches
    long switched = 0;            ///< its involuntary ones
    long others_switched = 0;     ///< involuntary ones of the process's other threads
    std::optional<double> steal;  ///< s that a hypervisor took from all cores; none: not told

    /// Whether every thread of the process kept its core. Steal that is not told counts as none.
    bool had_cores() const {
        return switched == 0 && others_switched == 0 && steal.value_or(0) == 0;
    }
};

/// Steal time of all cores since the machine started, s, from the text of /proc/stat; none where
/// it does not tell. `ticks_per_s`: its unit.
std::optional<double> steal_of(std::string_view stat, double ticks_per_s);

/// Measures the core use of the calling thread, from `start` to `stop`. Both allocate nothing.
/// Steal comes in ticks of the kernel, of 10 ms mostly, so that a short interval has none or a
/// whole tick.
class CoreWatch {
  public:
    explicit CoreWatch(const std::filesystem::path& stat = "/proc/stat");
    ~CoreWatch();
    CoreWatch(const CoreWatch&) = delete;
    CoreWatch& operator=(const CoreWatch&) = delete;

    void start();
    CoreUse stop() const;

  private:
    struct Totals {
        double cpu_s = 0;
        long blocked = 0, switched = 0, process_switched = 0;
    };
    static Totals totals();
    std::optional<double> steal() const;

    int stat_ = -1;
    double ticks_per_s_;
    Totals begin_;
    std::optional<double> steal_at_begin_;
};

/// A timed frame.
struct FrameSample {
    double seconds = 0;
    CoreUse cores;
};

/// Times of frames, of all and of those that had their cores.
struct FrameTimes {
    Distribution all, with_cores;
    double cpu_s = 0;  ///< mean CPU time of a frame on the simulation thread
    long blocked = 0, switched = 0, others_switched = 0;  ///< sums over the frames
    std::optional<double> steal_s;                        ///< sum; none: not told

    /// Whether those with their cores are enough to be judged by: a hundred, and a tenth of all.
    bool can_judge_with_cores() const {
        return with_cores.count >= 100 && 10 * with_cores.count >= all.count;
    }
};

FrameTimes frame_times(std::span<const FrameSample> frames);

/// Figures of a case for its lines and its JSON. The 99th percentile of the frames that had their
/// cores is in ms, "none" where none had.
std::string p99_with_cores_text(const FrameTimes& times);
std::string core_use_text(const FrameTimes& times);
nlohmann::json json_of(const FrameTimes& times);

}  // namespace livetet
