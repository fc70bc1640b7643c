#include "apps/viewer/track_view.hpp"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

constexpr double shortest_picture_s = 1.0 / 30;  // mean: more would only slow the simulation
constexpr double longest_behind_s = 0.1;         // delay that later pictures may make up for
constexpr double shortest_text_s = 0.25;         // drawing text takes a tenth of a picture's time

/// Lets this thread, and those that a software renderer starts from it, run only on idle cores:
/// pictures, unlike frames, may be late.
void give_way() {
    const sched_param none{};
    (void)::pthread_setschedparam(::pthread_self(), SCHED_IDLE, &none);
}

}  // namespace

TrackView::TrackView(ShownBody body, const StopSource& stop, Options options)
    : body_(std::move(body)), stop_(stop), options_(std::move(options)) {
    thread_ = std::thread([this] { run(); });
}

TrackView::~TrackView() {
    abandoned_ = true;
    if (thread_.joinable()) thread_.join();
}

std::optional<HandPull> TrackView::pull() {
    if (pulls_.take()) pull_ = pulls_.incoming();
    return pull_;
}

std::shared_ptr<const HandCut> TrackView::cut() {
    const std::shared_ptr<const HandCut>* line = cuts_.oldest();
    if (!line) return nullptr;
    std::shared_ptr<const HandCut> cut = *line;
    cuts_.pop();
    return cut;
}

void TrackView::on_frame(const Frame& frame, const TrackedBody& tracked, const StreamSample&) {
    Seen& seen = frames_.outgoing();
    seen.frame = frame;
    seen.displacement = frame.displacement;
    seen.tools = tracked.tools();
    seen.driven = tracked.driven();
    seen.targets = tracked.target_names();
    frames_.post();
}

void TrackView::finish() {
    run_over_ = true;
    thread_.join();
    if (!failure_.empty()) fail("{}", failure_);
}

void TrackView::run() {
    give_way();
    try {
        ViewWindow window(body_, options_.surface, options_.size);
        window.set_slices_in_turns(true);
        lead(window);
        if (!options_.screenshot.empty() && !abandoned_) window.write_png(options_.screenshot);
    } catch (const std::exception& error) {
        failure_ = error.what();
        log_warning(failure_);
    }
    if (!run_over_) (void)stop_.request_stop();
}

void TrackView::lead(ViewWindow& window) {
    window.handlers.pull = [this](const std::optional<HandPull>& pull) {
        pulls_.outgoing() = pull;
        pulls_.post();
    };
    window.set_cut_depth(options_.cut_depth);
    window.handlers.cut = [this](const HandCut& cut) {
        if (run_over_) return log_warning("the run is over: lines cut nothing any more");
        std::shared_ptr<const HandCut>* slot = cuts_.free_slot();
        if (!slot) return log_warning("the line cuts nothing: no frame has taken those before it");
        *slot = std::make_shared<const HandCut>(cut);
        cuts_.push();
    };
    if (options_.script) {
        const Stage stage{{}, {}, [&](double seconds) {
                              const double end_s = steady_seconds() + seconds;
                              bool open = true;
                              while (open && steady_seconds() < end_s) open = advance(window);
                              return open;
                          }};
        options_.script->run(window, stage);
        return;
    }
    const bool has_user = options_.surface == Surface::on_screen;
    const StopToken stop = stop_.token();
    while (advance(window) && !stop.stop_requested() && (has_user || !run_over_)) continue;
}

bool TrackView::advance(ViewWindow& window) {
    const double start_s = steady_seconds();
    const bool is_open = window.process_events();
    if (frames_.take()) {
        ShownMoment moment = moment_of(frames_.incoming());
        std::string shown;
        for (const ShownSensor& s : moment.sensors) shown += s.now ? s.name + '\n' : "";
        for (const ShownTool& t : moment.tools) shown += t.name + '\n';
        for (const ShownTarget& t : moment.targets) shown += t.name + '\n';
        moment.keeps_numbers = shown == labels_ && start_s < renewed_s_ + shortest_text_s;
        if (!moment.keeps_numbers) renewed_s_ = start_s, labels_ = std::move(shown);
        if (const auto& cut = frames_.incoming().frame.cut; cut != cut_) {
            cut_ = cut;
            set_mesh(body_, cut_->mesh);
            window.change_body(std::move(moment));
        } else {
            window.show(std::move(moment));
        }
        window.grow_range();
    } else if (start_s >= renewed_s_ + shortest_text_s) {
        window.renew_texts();
    }
    const bool drawn = window.draw();
    const double took_s = steady_seconds() - start_s;
    if (drawn) {
        ++pictures_;
        picture_s_ = took_s;
    }
    double left_s = 0.002;
    if (drawn) {
        due_s_ = std::max(due_s_ + shortest_picture_s, start_s + took_s - longest_behind_s);
        left_s = due_s_ - start_s - took_s;
    }
    if (left_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(left_s));
    return is_open && !abandoned_;
}

ShownMoment TrackView::moment_of(const Seen& seen) const {
    ShownMoment moment;
    moment.time_s = seen.frame.time_s;
    moment.displacement = seen.displacement;
    moment.pull = seen.frame.pull;
    // First the reference, then the sensors, then the tools of the scene.
    for (std::size_t i = 0; i < seen.tools.size() && i < seen.frame.image_from_tool.size(); ++i) {
        const TrackedPose& pose = seen.frame.image_from_tool[i];
        const bool is_sensor = i > 0 && i <= seen.frame.sensors.size();
        if (is_usable(pose) && !is_sensor)
            moment.tools.push_back(
                {seen.tools[i].tool, seen.tools[i].has_tip, {pose.rotation, pose.translation}});
        if (!is_sensor) continue;
        ShownSensor& sensor =
            moment.sensors.emplace_back(ShownSensor{seen.tools[i].tool, {}, {}, {}});
        if (const auto& base = seen.frame.sensors[i - 1].base) sensor.base = base->translation;
        if (is_usable(pose)) sensor.now = pose.translation;
    }
    moment.sensors.push_back({"", {}, {}, seen.driven});  // all patches
    moment.text = fmt::format(
        "live: {:.1f} mm pressed, frame in {:.1f} ms, {}", 1e3 * seen.frame.press,
        1e3 * (seen.frame.sensor_s + seen.frame.step.operator_s + seen.frame.step.forces_s +
               seen.frame.step.solve_s + seen.frame.step.finish_s + seen.frame.output_s),
        counted(seen.frame.step.iterations, "iteration"));
    add_statement(moment, seen.frame.statement, seen.targets);
    return moment;
}

}  // namespace livetet
