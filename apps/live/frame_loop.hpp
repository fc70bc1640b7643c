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

/// What tells a run's time: the samples' own time, or, where it may be set while it runs, when they
/// came.
enum class SampleClock { own, arrival };

/// Whoever watches a run and has a hand in it. Called from the simulation's thread, so it must
/// never wait.
class FrameObserver {
  public:
    virtual ~FrameObserver() = default;
    /// The marker pulled by hand, for the next frame.
    virtual std::optional<HandPull> pull() = 0;
    virtual void on_frame(const Frame& frame, const TrackedBody& tracked,
                          const StreamSample& sample) = 0;
    /// After the last frame: may wait, for a user who goes on looking. Throws Error where watching
    /// failed.
    virtual void finish() {}
};

/// How the frames of a run are computed.
struct FramePlan {
    std::optional<double> budget_s{};  ///< each frame is due so long after it began
    bool every_sample = false;
    double seconds = 0;  ///< from the first sample on; 0: to the source's end
    StopToken stop{};    ///< ends the run
    SampleClock clock = SampleClock::own;
    FrameObserver* observer = nullptr;
};

/// What a run of frames came to.
struct FrameCounts {
    std::size_t frames = 0, missed = 0, not_kept = 0,
                not_converged = 0;  ///< not_kept: by the end, counted in the result
    std::uint64_t samples = 0;
    std::size_t came = 0;  ///< frames in whose sample a tool came
    /// Of samples that follow each other and in which a tool came: how many steps from one to the
    /// next, and how long.
    std::uint64_t steps = 0;
    double steps_s = 0;
    std::vector<SceneEvent> events;

    double interval_s() const { return steps > 0 ? steps_s / static_cast<double>(steps) : 0; }
};

/// Frame after frame to the source's end, or until `plan.stop` asks for it. `scene` is changed as
/// `watch` says, which may be nullptr, as may the recorder; `counts` holds what was done even where
/// an exception ends it.
void run_frames(Scene& scene, TrackerSource& source, TrackedBody& tracked, Recorder* recorder,
                FramePublisher& publisher, SceneWatch* watch, const FramePlan& plan,
                FrameCounts& counts);

}  // namespace livetet
