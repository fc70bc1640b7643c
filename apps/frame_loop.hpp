#pragma once

#include <optional>
#include <vector>

#include "apps/announcer.hpp"
#include "apps/live_model.hpp"
#include "apps/recorder.hpp"
#include "apps/replay.hpp"
#include "apps/scene_watch.hpp"
#include "tracking/source.hpp"

namespace livetet {

/// How the frames of a run are computed.
struct FramePlan {
    std::optional<double> budget_s{};  ///< each frame is due so long after it began
    bool every_sample = false;
    double seconds = 0;  ///< of the samples' time; 0: to the source's end
};

/// What a run of frames came to.
struct FrameCounts {
    std::size_t frames = 0, missed = 0, not_kept = 0, not_converged = 0;
    std::uint64_t samples = 0;
    double first_s = 0, last_s = 0;  ///< of the frames' samples
    std::vector<SceneEvent> events;
};

/// Frame after frame to the source's end, or until Ctrl-C or SIGTERM, of which a second one ends the program. `scene` is
/// changed as `watch`, which may be nullptr, says.
FrameCounts run_frames(Scene& scene, TrackerSource& source, LiveModel& model, Recorder& recorder, Announcer& announcer,
                       SceneWatch* watch, const FramePlan& plan);

}  // namespace livetet
