#include "apps/live/frame_loop.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#include "base/error.hpp"
#include "base/log.hpp"
#include "base/stopwatch.hpp"
#include "config/yaml.hpp"
#include "tracking/latency_estimate.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

void take_changes(SceneChange& change, Scene& scene, TrackedBody& tracked, FrameCounts& counts) {
    try {
        Scene next = with_changes(scene, change.scene);
        tracked.change(std::move(change));
        scene = std::move(next);
        counts.events.push_back({counts.frames, to_yaml(scene)});
        log_info("the changed scene is applied");
    } catch (const Error& error) {
        log_warning(fmt::format("{}; the scene stays as it was", error.what()));
    }
}

/// Counts samples, and measures the time between those that are used.
class SampleCount {
  public:
    explicit SampleCount(SampleClock clock) : clock_(clock) {}

    void take(const StreamSample& sample, FrameCounts& counts) {
        const double now_s =
            clock_ == SampleClock::arrival ? sample.arrived_s : sample.sample.time_s;
        const bool came = std::ranges::any_of(sample.sample.poses, was_reported);
        if (first_s_) {
            const std::uint64_t steps = sample.number - number_;
            counts.missed += steps - 1;
            counts.samples += steps;
            if (came && came_) counts.intervals.add(steps, now_s - now_s_);
        } else {
            first_s_ = now_s;
            counts.samples = 1;
        }
        counts.came += came;
        number_ = sample.number;
        now_s_ = now_s;
        came_ = came;
    }
    double seconds() const { return now_s_ - first_s_.value_or(now_s_); }

  private:
    SampleClock clock_;
    std::optional<double> first_s_;
    double now_s_ = 0;
    std::uint64_t number_ = 0;
    bool came_ = false;
};

/// FrameLimits::ahead_s of the next frame: with `ahead_ms: auto` the time until it is shown, in
/// the samples' time.
std::optional<double> ahead_of_next(const TrackOptions& track, const FramePlan& plan,
                                    const LatencyEstimate& latency) {
    if (!track.ahead_ms || !track.ahead_ms->is_auto()) return {};
    if (plan.every_sample) return 0;  // not in real time: nobody waits for the frame
    return std::min(plan.speed * (latency.seconds() + track.display_ms / 1e3),
                    LatencyEstimate::max_s);
}

}  // namespace

void IntervalCount::add(std::uint64_t samples, double seconds) {
    if (samples == 0) return;
    count_ += samples;
    total_s_ += seconds;
    const double each_s = seconds / static_cast<double>(samples);
    if (recent_s_.size() < recent_s_.capacity()) {
        recent_s_.push_back(each_s);
        return;
    }
    recent_s_[oldest_] = each_s;
    oldest_ = (oldest_ + 1) % recent_s_.size();
}

double IntervalCount::median_s() const {
    if (recent_s_.empty()) return 0;
    std::vector<double> sorted = recent_s_;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return *middle;
}

void run_frames(Scene& scene, TrackerSource& source, TrackedBody& tracked, Recorder* recorder,
                FramePublisher& publisher, SceneWatch* watch, const FramePlan& plan,
                FrameCounts& counts) {
    (void)source.take();  // discards a sample from before the run
    SampleCount count(plan.clock);
    LatencyEstimate latency;
    std::optional<double> last_s;  // time of the last frame
    while (!plan.stop.stop_requested()) {
        const StreamSample* sample = source.next();
        if (!sample) break;
        const auto start = Clock::now();
        if (SceneChange* change = watch ? watch->take() : nullptr)
            take_changes(*change, scene, tracked, counts);
        FrameLimits limits{.ahead_s = ahead_of_next(*scene.track, plan, latency)};
        if (plan.budget_s) limits.deadline = Deadline::after(start, *plan.budget_s);
        if (plan.observer) {
            tracked.pull(plan.observer->pull());
            tracked.cut_by_hand(plan.observer->cut());
        }
        const Frame& frame =
            tracked.advance(sample->sample, limits,
                            counts.frames > 0 ? source.passed() : std::span<const TrackerSample>{});
        const double seconds = seconds_since(start);
        count.take(*sample, counts);
        if (recorder && counts.frames % scene.output.every == 0) {
            bool kept = recorder->keep(frame, *sample, seconds);
            while (!kept && plan.every_sample &&
                   !recorder->failed()) {  // not in real time: wait for the disk
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
                kept = recorder->keep(frame, *sample, seconds);
            }
        } else if (recorder) {
            recorder->pass_over(frame);
        }
        counts.not_converged += !frame.step.converged;
        ++counts.frames;
        if (plan.observer) plan.observer->on_frame(frame, tracked, *sample);
        publisher.publish(frame, tracked, scene, *sample, counts.frames, counts.missed);
        if (frame.time_s != last_s)  // else it was not computed again
            latency.add(steady_seconds() - sample->arrived_s);
        last_s = frame.time_s;
        tracked.work_on_responses();
        if (!plan.every_sample)
            tracked.prepare_cut([&] { return source.has_next() || plan.stop.stop_requested(); });
        if (plan.length_s && count.seconds() >= *plan.length_s) break;
    }
}

}  // namespace livetet
