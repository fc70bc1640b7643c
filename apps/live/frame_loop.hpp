#pragma once

#include <optional>
#include <vector>

#include "apps/live/frame_publisher.hpp"
#include "apps/live/recorder.hpp"
#include "apps/live/replay.hpp"
#include "apps/live/scene_watch.hpp"
#include "apps/live/tracked_body.hpp"
#include "base/stop_token.hpp"
#include "tracking/source.hpp"

namespace livetet {

/// Clock that run durations are measured by: the samples' own time stamps or, where that clock may
/// be set during a run, their arrival times.
enum class SampleClock { own, arrival };

/// Observes the frames of a run, and may pull a marker and cut. Called from the simulation thread,
/// so no function but `finish` may wait.
class FrameObserver {
  public:
    virtual ~FrameObserver() = default;
    /// The marker that the user pulls, for the next frame; none: nothing is pulled.
    virtual std::optional<HandPull> pull() = 0;
    /// The oldest line that the user has drawn and no frame has cut along; none: there is none.
    virtual std::shared_ptr<const HandCut> cut() { return {}; }
    virtual void on_frame(const Frame& frame, const TrackedBody& tracked,
                          const StreamSample& sample) = 0;
    /// Called after the last frame; may wait for a user who goes on looking. Throws Error if
    /// observing failed.
    virtual void finish() {}
};

/// How the frames of a run are computed.
struct FramePlan {
    std::optional<double> budget_s{};  ///< time limit of a frame, from its start
    bool every_sample = false;
    std::optional<double> length_s{};  ///< from the first sample; none: to the source's end
    StopToken stop{};                  ///< stops the run
    SampleClock clock = SampleClock::own;
    FrameObserver* observer = nullptr;
    double speed = 1;  ///< seconds of the samples' time that pass in a second
};

/// Times between samples. Allocates nothing after its construction.
class IntervalCount {
  public:
    IntervalCount() { recent_s_.reserve(4096); }

    /// `samples` intervals took `seconds` together.
    void add(std::uint64_t samples, double seconds);
    double mean_s() const { return count_ > 0 ? total_s_ / static_cast<double>(count_) : 0; }
    /// Of the last 4,096 additions. A pause moves the mean, but not the median.
    double median_s() const;

  private:
    std::uint64_t count_ = 0;
    double total_s_ = 0;
    std::vector<double> recent_s_;
    std::size_t oldest_ = 0;  ///< index in recent_s_, once it is full
};

/// Counts of a run.
struct FrameCounts {
    std::size_t frames = 0, missed = 0, not_kept = 0,
                not_converged = 0;  ///< missed: samples without a frame; not_kept: frames that are
                                    ///< not in the result, known at the end
    std::uint64_t samples = 0;
    std::size_t came = 0;     ///< frames whose sample had a pose of any tool
    IntervalCount intervals;  ///< between samples with a pose
    std::vector<SceneEvent> events;
};

/// Computes frames until the source ends, `plan.length_s` is over or `plan.stop` asks for it. Each
/// frame goes to the recorder, the observer and the publisher. `recorder` may be nullptr: nothing
/// is kept; `watch` may be nullptr: the scene does not change. Changes that `watch` reports are
/// applied to `scene` and `tracked`. `counts` is valid even if an exception ends the run.
void run_frames(Scene& scene, TrackerSource& source, TrackedBody& tracked, Recorder* recorder,
                FramePublisher& publisher, SceneWatch* watch, const FramePlan& plan,
                FrameCounts& counts);

}  // namespace livetet
