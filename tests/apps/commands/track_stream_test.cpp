#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "apps/commands/tracked_block.hpp"
#include "io/openigtlink/conversions.hpp"
#include "io/openigtlink/messages.hpp"
#include "io/openigtlink/sockets.hpp"
#include "support/server.hpp"
#include "tracking/poses.hpp"
#include "tracking/source.hpp"

namespace livetet {
namespace {

using namespace igtl::testing_messages;
using namespace igtl::testing_sockets;
using test::largest;
using test::Tracked;

constexpr double step_s = 0.02;

/// A tracker server as PLUS is one, scripted: TRANSFORMs of version 2 with their status, fifty
/// times a second.
class ScriptedPlus {
  public:
    explicit ScriptedPlus(const SimulatedTrackerOptions& tracker) : tracker_(tracker) {}
    std::uint16_t port() const { return listening_.port(); }
    /// The clock that it stamps by: UTC.
    double now() const { return began_s_ + time_s_; }

    void accept() {
        peer_.emplace(listening_.accept());
        if (began_s_ == 0) began_s_ = utc_seconds();
        time_s_ = std::max(time_s_, utc_seconds() - began_s_);
    }
    void close() { peer_.reset(); }
    /// Sends for so long; `sensor(t)`: the messages that stand for the sensor pressed `depth` deep.
    template <class Send>
    void run(double seconds, Send&& send_sensor) {
        const auto start = std::chrono::steady_clock::now();
        const int steps = static_cast<int>(seconds / step_s);
        for (int i = 0; i < steps; ++i) {
            std::this_thread::sleep_until(start + std::chrono::duration<double>(i * step_s));
            time_s_ += step_s;
            send("ReferenceToTracker",
                 true_tracker_from_image(tracker_, time_s_) * tracker_.image_from_reference, "OK");
            send_sensor(static_cast<double>(i) / steps);
        }
    }
    igtl::Message sensor(double depth, const Vector3& off = Vector3::Zero(),
                         const char* status = "OK") const {
        auto image_from_sensor = tracker_.image_from_sensor_at_rest;
        image_from_sensor.translation += Vector3(0, 0, -depth) + off;
        return message("SensorToTracker",
                       true_tracker_from_image(tracker_, time_s_) * image_from_sensor, status);
    }
    Peer& peer() { return *peer_; }

  private:
    template <class Frame>
    igtl::Message message(const char* name, const RigidTransform<Tracker, Frame>& pose,
                          const char* status) const {
        const bool valid = std::string(status) == "OK";
        return with_metadata(
            igtl::transform_message(name, pose, now()),
            {{"TransformValid", valid ? "true" : "false"}, {"TransformStatus", status}});
    }
    template <class Frame>
    void send(const char* name, const RigidTransform<Tracker, Frame>& pose, const char* status) {
        peer_->send(message(name, pose, status));
    }

    SimulatedTrackerOptions tracker_;
    ListeningPeer listening_;
    std::optional<Peer> peer_;
    double began_s_ = 0, time_s_ = 0;
};

/// What a client like 3D Slicer is sent.
struct Received {
    std::map<std::string, int> messages;  ///< by type and device
    std::set<int> statuses;
    std::set<std::string> texts;
    double deepest_mm = 0;
    bool is_known = false;  ///< the server knows that the client takes version 2

    void read(Peer client) {
        client.send(with_metadata(message("STATUS", igtl::Status{1, 0, "", ""}), {}));
        try {
            for (;;) {
                const igtl::Message m = client.receive_message();
                ++messages[m.type + " " + m.device];
                // What was sent before the server had read the client's message is of version 1.
                EXPECT_EQ(m.version, is_known || m.version == 2 ? 2 : 1);
                is_known = is_known || m.version == 2;
                if (const auto* status = std::get_if<igtl::Status>(&m.content)) {
                    statuses.insert(status->code);
                    texts.insert(status->text);
                }
                if (const auto* surface = std::get_if<igtl::PolyData>(&m.content))
                    for (const float mm : surface->attributes.at(0).values)
                        deepest_mm = std::max(deepest_mm, double(mm));
            }
        } catch (const std::exception&) {  // the run has ended
        }
    }
};

/// The port in a line of the program that says where it serves; 0 while there is none.
std::uint16_t served_port(const Tracked& t) {
    const std::string said = test::text_of(t.folder / "stderr.txt"), before = "127.0.0.1 port ";
    const std::size_t at = said.find(before);
    return at == std::string::npos || said.find('\n', at) == std::string::npos
               ? 0
               : static_cast<std::uint16_t>(std::stoi(said.substr(at + before.size())));
}

using Parts = std::map<std::string, double>;  ///< when each part of a script begins, s

/// Sends the sensor pressed in by `depth` m, over and over.
auto held(ScriptedPlus& plus, double depth) {
    return [&plus, depth](double) { plus.peer().send(plus.sensor(depth)); };
}

/// A sensor that is pressed in, and all that can go wrong with it.
Parts play_faults(ScriptedPlus& plus) {
    Parts at;
    const auto begins = [&](const char* part) { at[part] = plus.now(); };
    plus.run(0.8, [&](double) {
        plus.peer().send(plus.sensor(0, {0, 0, 0.1}));
    });  // not on the organ yet
    plus.run(2, held(plus, 0));
    begins("press");
    plus.run(0.6, [&](double share) { plus.peer().send(plus.sensor(0.01 * share)); });
    begins("pressed");
    plus.run(0.6, held(plus, 0.01));
    begins("not a number");
    plus.run(0.2, [&](double) {
        igtl::Message m = plus.sensor(0.01);
        std::get<igtl::Transform>(m.content).matrix[9] = std::numeric_limits<float>::quiet_NaN();
        plus.peer().send(m);
    });
    plus.run(0.2, [&](double) {
        igtl::Bytes wrong = igtl::encode(plus.sensor(-0.03));
        wrong[igtl::header_size + 50] ^= 16;  // the CRC says so
        plus.peer().send(wrong);
    });
    plus.run(0.6, held(plus, 0.01));
    begins("jump");
    plus.run(0.04, [&](double) { plus.peer().send(plus.sensor(0.01, {0.3, 0, 0})); });
    plus.run(0.4, held(plus, 0.01));
    begins("far away");
    plus.run(1.2, [&](double) { plus.peer().send(plus.sensor(0.01, {0, 2, 0})); });
    begins("back");
    plus.run(1.5, held(plus, 0.01));
    begins("out of volume");
    plus.run(0.3, [&](double) { plus.peer().send(plus.sensor(0.01, {}, "OUT_OF_VOLUME")); });
    begins("silent sensor");
    plus.run(1.2, [](double) {});
    begins("back again");
    plus.run(1.5, held(plus, 0.01));
    const igtl::Bytes half = igtl::encode(plus.sensor(0.01));
    plus.peer().send(igtl::ByteView(half).first(70));
    plus.close();
    plus.accept();  // it comes back by itself
    begins("new connection");
    plus.run(1.5, held(plus, 0.01));
    begins("end");
    plus.run(0.3, held(plus, 0.01));
    return at;
}

/// What the loop did in each part of play_faults().
void expect_followed(const ResultReader& result, Parts at) {
    enum Status { placing, following, returning, holding, releasing, released };
    std::map<std::string, std::set<Status>> seen;
    std::map<std::string, double> least, most;
    std::map<std::string, int> frames;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const double time = result.times_s()[k], now = largest(result.displacement(k));
        EXPECT_LT(now, 0.013) << "never farther than it was pressed, at " << time - at["press"]
                              << " s";
        std::string part = "start";
        for (const auto& [name, begin] : at)
            if (begin <= time && (part == "start" || begin > at[part])) part = name;
        const std::vector<double> sensors = result.values("sensors", k, 6);
        seen[part].insert(static_cast<Status>(std::max_element(sensors.begin(), sensors.end()) -
                                              sensors.begin()));
        ++frames[part];
        if (!least.count(part)) least[part] = 1;
        least[part] = std::min(least[part], now);
        most[part] = std::max(most[part], now);
    }
    for (const auto& [name, begin] : at) EXPECT_GT(frames[name], 3) << name << ": the loop goes on";
    EXPECT_TRUE(seen["start"].count(placing) && seen["start"].count(following));
    EXPECT_EQ(seen["not a number"].count(releasing), 0u) << "0.4 s of nonsense is less than hold_s";
    EXPECT_GT(least["not a number"], 0.008) << "what is not a number, or has a wrong CRC, holds";
    EXPECT_TRUE(seen["not a number"].count(holding));
    EXPECT_GT(least["jump"], 0.008) << "one sample far off is not believed";
    EXPECT_TRUE(seen["far away"].count(holding) && seen["far away"].count(releasing) &&
                seen["far away"].count(released));
    EXPECT_LT(least["back"], 0.004) << "let go, it went home";
    EXPECT_TRUE(seen["back"].count(returning) && seen["back"].count(following));
    EXPECT_TRUE(seen["out of volume"].count(holding));
    EXPECT_TRUE(seen["silent sensor"].count(released)) << "a sensor that falls silent times out";
    EXPECT_TRUE(seen["back again"].count(following));
    EXPECT_TRUE(seen["new connection"].count(following));
    EXPECT_GT(most["end"], 0.008);
}

void expect_served(Received& received) {
    EXPECT_TRUE(received.is_known);
    EXPECT_GT(received.messages["POLYDATA Organ"], 20);
    EXPECT_GT(received.messages["TRANSFORM TrackerToRAS"], 20);
    EXPECT_GT(received.messages["TRANSFORM ReferenceToRAS"], 20);
    EXPECT_GT(received.messages["TRANSFORM SensorToRAS"], 20);
    EXPECT_GT(received.messages["STRING LivetetFrame"], 20);
    EXPECT_EQ(received.messages.count("TRANSFORM ProbeToRAS"), 0u) << "never came";
    EXPECT_TRUE(received.statuses.count(1) && received.statuses.count(7));
    std::string texts;
    for (const std::string& text : received.texts) texts += text + "\n";
    for (const char* text : {"Sensor holding (not a pose)", "Sensor released (too far)",
                             "Sensor holding (out of volume)", "Sensor released (stale)",
                             "registration valid; Sensor following\n"})
        EXPECT_NE(texts.find(text), std::string::npos) << text << " is not in\n" << texts;
    EXPECT_TRUE(received.texts.count("registration valid; Sensor 100 mm off the organ"));
    EXPECT_NEAR(received.deepest_mm, 10, 1);
}

TEST(TrackStream, FollowsAServerThroughAllThatCanGoWrongAndServesWhatItComputes) {
    Tracked t;
    t.tracker.position_rms_mm = t.tracker.rotation_rms_deg = 0;
    ScriptedPlus plus(t.tracker);
    t.set_source("openigtlink://127.0.0.1:" + std::to_string(plus.port()));
    t.set_track(
        "base_window_s: 0.5, hold_s: 0.5, release_s: 0.4, max_displacement_mm: 50, budget: 15 ms, "
        "tools: [{tool: Probe}]");
    auto run = std::async(std::launch::async, [&] {
        return test::livetet(t.folder, "track scene.yaml --publish 0", "echo $$ > pid.txt && exec");
    });
    ASSERT_TRUE(eventually([&] { return served_port(t) > 0; }))
        << test::text_of(t.folder / "stderr.txt");
    plus.accept();
    const Peer never_reads = connect_to(served_port(t));
    Received received;
    auto reading =
        std::async(std::launch::async, [&] { received.read(connect_to(served_port(t))); });

    const Parts at = play_faults(plus);
    ASSERT_EQ(::kill(std::stoi(test::text_of(t.folder / "pid.txt")), SIGINT), 0)
        << "Ctrl-C ends it";
    try {
        for (;;) plus.run(0.1, held(plus, 0.01));
    } catch (const std::exception&) {  // it has ended
    }
    const test::Outcome outcome = run.get();
    reading.wait();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("no Probe yet; what comes: ReferenceToTracker, SensorToTracker"),
              std::string::npos)
        << outcome.err;

    expect_followed(ResultReader(t.folder / "result.h5"), at);
    expect_served(received);

    const auto replay = test::livetet(t.folder, "track --replay result.h5");
    EXPECT_EQ(replay.status, 0) << replay.out << replay.err;
}

TEST(TrackStream, AServerThatComesLateAndFallsSilentIsFollowedAndLeftGently) {
    Tracked t;
    t.tracker.position_rms_mm = t.tracker.rotation_rms_deg = 0;
    ScriptedPlus plus(t.tracker);
    t.set_source("openigtlink://127.0.0.1:" + std::to_string(plus.port()));
    t.set_track("base_window_s: 0.5, hold_s: 0.5, release_s: 1, budget: 15 ms");
    auto run = std::async(std::launch::async,
                          [&] { return test::livetet(t.folder, "track scene.yaml --for 8"); });
    std::this_thread::sleep_for(std::chrono::milliseconds(2000));
    plus.accept();
    const auto held = [&](double depth) {
        return [&plus, depth](double) { plus.peer().send(plus.sensor(depth)); };
    };
    plus.run(1.5, held(0));
    plus.run(0.5, [&](double share) { plus.peer().send(plus.sensor(0.01 * share)); });
    plus.run(0.3, held(0.01));
    const double last_s = plus.now();
    const test::Outcome outcome = run.get();  // while nothing comes, it ends by itself
    ASSERT_EQ(outcome.status, 0) << outcome.err;

    const ResultReader result(t.folder / "result.h5");
    const std::vector<double>& times = result.times_s();
    EXPECT_NEAR(times.back() - times.front(), 8, 1) << "one axis of time, of --for";
    std::size_t valid = 0, releasing = 0;
    double min_gap_s = 1;
    for (std::size_t k = 1; k < result.frame_count(); ++k) {
        EXPECT_LT(times[k] - times[k - 1], 1);
        valid += result.values("registration_status", k, 1)[0] == 0;
        if (times[k] <= last_s) continue;
        releasing += result.values("sensors", k, 6)[4] == 1;
        min_gap_s = std::min(min_gap_s, times[k] - last_s);
        const double step =
            std::abs(largest(result.displacement(k)) - largest(result.displacement(k - 1)));
        EXPECT_LT(step, 0.0025) << "no jump, " << times[k] - last_s << " s after the last sample";
    }
    EXPECT_GT(valid, 30u);
    EXPECT_LT(min_gap_s, 0.5) << "not only when the connection counts as silent";
    EXPECT_GT(releasing, 7u) << "its grip falls little by little";
    EXPECT_NEAR(nlohmann::json::parse(result.text("run"))["interval_ms"].get<double>(),
                1e3 * step_s, 10);
}

TEST(TrackStream, WhereEveryNameIsWrongItSaysWhichComeAndEnds) {
    Tracked t;
    ListeningPeer server;
    t.set_source("openigtlink://127.0.0.1:" + std::to_string(server.port()));
    auto run = std::async(std::launch::async,
                          [&] { return test::livetet(t.folder, "track scene.yaml --for 3"); });
    Peer peer = server.accept();
    try {
        for (;; std::this_thread::sleep_for(std::chrono::milliseconds(20)))
            peer.send(igtl::transform_message("StylusToTracker", RigidTransform<Tracker, Tool>{},
                                              utc_seconds()));
    } catch (const std::exception&) {  // it has ended
    }
    const test::Outcome outcome = run.get();
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("no pose of a tool came, nothing is kept"), std::string::npos)
        << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(t.folder / "result.h5"));
    EXPECT_NE(outcome.err.find("no Reference, Sensor yet; what comes: StylusToTracker"),
              std::string::npos)
        << outcome.err;
}

TEST(TrackStream, NeitherCtrlCTwiceNorATerminalThatIsGoneNorSigkillLosesTheResult) {
    Tracked t;
    t.tracker.hold_s = 30;
    t.record();
    write_sequence(t.folder / "served.igs.mha", t.recording);
    test::Server server(t.folder, "served.igs.mha", {"--loop"});
    t.set_source(server.url());
    for (const int signal : {SIGINT, SIGHUP, SIGKILL}) {
        test::Running run(t.folder, "track", {"track", "scene.yaml", "--publish", "0"});
        ASSERT_TRUE(
            eventually([&] { return run.errors().find("127.0.0.1 port ") != std::string::npos; }));
        std::this_thread::sleep_for(std::chrono::milliseconds(5000));
        for (int i = 0; i < 20; ++i, std::this_thread::sleep_for(std::chrono::milliseconds(20)))
            run.send(signal);
        const test::Outcome outcome = run.wait();
        std::string result = "result.h5";
        if (signal == SIGKILL) {
            for (const auto& entry : std::filesystem::directory_iterator(t.folder.path()))
                if (entry.path().filename().string().starts_with(".result.part"))
                    result = entry.path().filename();
        } else {
            EXPECT_EQ(outcome.status, 0) << signal << outcome.err;
        }
        const auto report = test::livetet(t.folder, "report " + result);
        EXPECT_EQ(report.status, 0) << report.err;
        EXPECT_EQ(report.out.find("the program was killed") != std::string::npos, signal == SIGKILL)
            << report.out;
        EXPECT_GT(ResultReader(t.folder / result).frame_count(), 10u);
        std::filesystem::remove(t.folder / result);
    }
}

TEST(TrackStream, APortThatIsTakenIsSaidAndNothingIsLeft) {
    Tracked t;
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    const ListeningPeer other;
    test::expect_refused(
        test::livetet(t.folder, "track scene.yaml --publish " + std::to_string(other.port())),
        {"cannot listen on 127.0.0.1 port " + std::to_string(other.port()), "free port"});
    EXPECT_FALSE(std::filesystem::exists(t.folder / "result.h5"));
}

}  // namespace
}  // namespace livetet
