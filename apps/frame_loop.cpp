#include "apps/frame_loop.hpp"

#include <chrono>
#include <thread>

#include "apps/interruptible.hpp"
#include "base/error.hpp"
#include "config/yaml.hpp"

namespace livetet {

namespace {

void take_changes(const Scene& edited, Scene& scene, LiveModel& model, FrameCounts& counts) {
    try {
        model.change(edited);
        scene = with_changes(scene, edited);
        counts.events.push_back({counts.frames, to_yaml(scene)});
        Announcer::note("the scene's changes are taken up");
    } catch (const Error& error) {
        Announcer::note(fmt::format("{}; the scene stays as it was", error.what()));
    }
}

}  // namespace

FrameCounts run_frames(Scene& scene, TrackerSource& source, LiveModel& model, Recorder& recorder, Announcer& announcer,
                       SceneWatch* watch, const FramePlan& plan) {
    FrameCounts counts;
    const Interruptible interruptible;
    (void)source.take();  // what came before anyone kept it
    std::optional<std::uint64_t> last;
    while (!stop_asked && !recorder.failed()) {
        const StreamSample* sample = source.next();
        if (!sample) break;
        const auto start = Clock::now();
        if (const Scene* edited = watch ? watch->take() : nullptr) take_changes(*edited, scene, model, counts);
        FrameLimits limits;
        if (plan.budget_s)
            limits.deadline =
                start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(*plan.budget_s));
        const Frame& frame = model.advance(sample->sample, limits);
        const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
        if (!last) last = sample->number - 1;
        counts.missed += sample->number - *last - 1;
        counts.samples += sample->number - *last;
        last = sample->number;
        if (counts.frames % scene.output.every == 0) {
            bool kept = recorder.keep(frame, *sample, seconds);
            while (!kept && plan.every_sample) {  // nothing is real time: wait for the disk
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
                kept = recorder.keep(frame, *sample, seconds);
            }
            counts.not_kept += !kept;
        }
        counts.not_converged += !frame.step.converged;
        if (counts.frames++ == 0) counts.first_s = frame.time_s;
        counts.last_s = frame.time_s;
        announcer.tell(frame, model, scene, *sample, counts.frames, counts.missed);
        if (plan.seconds > 0 && counts.last_s - counts.first_s >= plan.seconds) break;
    }
    return counts;
}

}  // namespace livetet
