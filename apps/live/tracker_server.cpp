#include "apps/live/tracker_server.hpp"

#include <chrono>
#include <thread>

#include "apps/live/tracker_source.hpp"
#include "base/progress.hpp"
#include "io/openigtlink/conversions.hpp"
#include "io/openigtlink/plus_pose.hpp"
#include "tracking/playback.hpp"

namespace livetet {

namespace {

constexpr std::chrono::milliseconds pause{20};

void wait(double seconds, const StopToken& stop) {
    const double end_s = steady_seconds() + seconds;
    while (!stop.stop_requested() && steady_seconds() < end_s) std::this_thread::sleep_for(pause);
}

/// Plays once from beginning to end, or until `stop`. `round` counts from 1.
void play(OpenIgtLinkServer& server, const DelayedRecording& played, int round,
          const StopToken& stop, const StatusCallback& show) {
    const double began_s = utc_seconds(), first_s = played.recording.samples.front().time_s;
    const std::size_t samples = played.recording.samples.size();
    Playback playback(
        played.recording,
        {1, played.delays_s, [&](const StreamSample& s) {
             const double time_s = began_s + s.sample.time_s - first_s;
             server.publish(sample_messages(played.recording.tools, s.sample, time_s));
         }});
    (void)playback.next();  // starts the playback
    for (std::uint64_t sent = 0; !stop.stop_requested() && sent < samples;
         std::this_thread::sleep_for(pause)) {
        sent = playback.status().samples;
        const auto statistics = server.statistics();
        if (show)
            show({},
                 fmt::format("{} clients, round {}: sample {} of {}, {} messages sent, {} dropped "
                             "for slow clients",
                             statistics.clients, round, sent, samples, statistics.sent,
                             statistics.dropped + statistics.skipped));
    }
}

}  // namespace

std::vector<igtl::Message> sample_messages(const std::vector<std::string>& tools,
                                           const TrackerSample& sample, double time_s) {
    std::vector<igtl::Message> messages;
    for (std::size_t i = 0; i < tools.size(); ++i) {
        const TrackedPose& pose = sample.poses[i];
        const bool seen = pose.status == PoseStatus::ok;
        const RigidTransform<Tracker, Tool> tracker_from_tool{pose.rotation, pose.translation};
        igtl::Message& m = messages.emplace_back(
            igtl::transform_message(tools[i] + std::string(to_tracker), tracker_from_tool, time_s));
        m.metadata = {{"TransformValid", 3, seen ? "true" : "false"},
                      {"TransformStatus", 3, std::string(pose_status_word(pose.status))}};
        m.version = seen ? 1 : 2;
    }
    return messages;
}

void serve(OpenIgtLinkServer& server, const DelayedRecording& played, Repeat repeat,
           const StopToken& stop, const StatusCallback& show) {
    if (played.recording.samples.empty())
        fail("the recording has no samples, expected some to play");
    const double interval_s = sample_interval(played.recording);
    if (show) show({}, "it begins when the first client connects");
    while (!stop.stop_requested() && server.statistics().connections == 0)
        std::this_thread::sleep_for(pause);
    for (int round = 1; !stop.stop_requested(); ++round) {
        play(server, played, round, stop, show);
        if (repeat == Repeat::once) return wait(0.2, stop);  // so that the last sample is sent
        wait(interval_s, stop);
    }
}

}  // namespace livetet
