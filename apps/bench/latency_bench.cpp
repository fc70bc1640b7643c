#include "apps/bench/latency_bench.hpp"

#define ASIO_STANDALONE
#include <fmt/format.h>

#include <asio.hpp>
#include <chrono>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/bench/distribution_table.hpp"
#include "apps/bench/realtime_cases.hpp"
#include "apps/live/frame_loop.hpp"
#include "apps/live/tracker_server.hpp"
#include "apps/phantom/phantom.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/interruptible.hpp"
#include "base/work_folder.hpp"
#include "config/yaml.hpp"
#include "io/openigtlink/parser.hpp"
#include "io/openigtlink/source.hpp"
#include "solvers/parallel/petsc_session.hpp"
#include "tracking/playback.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {

namespace {

using nlohmann::json;

constexpr double median_allowed_ms = 15, p99_allowed_ms = 25;
constexpr double settling_s = 3;  // sensors are placed, and buffers grow

/// When each sample came.
class ArrivalTimes {
  public:
    void keep(const StreamSample& sample) {
        const std::lock_guard lock(mutex_);
        times_[sample.number] = sample.arrived_s;
    }
    double of(std::uint64_t number) const {
        const std::lock_guard lock(mutex_);
        return times_.at(number);
    }

  private:
    mutable std::mutex mutex_;
    std::map<std::uint64_t, double> times_;
};

/// What a client sees of a frame: when its last message was there, and how long the frame itself
/// says that it took.
struct SeenFrame {
    std::uint64_t sample = 0;
    double seen_s = 0, computed_ms = 0;
};

/// A client of the published frames.
class FrameReader {
  public:
    explicit FrameReader(std::uint16_t port) {
        socket_.connect({asio::ip::make_address("127.0.0.1"), port});
        thread_ = std::thread([this] { read(); });
    }
    ~FrameReader() {
        if (thread_.joinable()) (void)finish();
    }
    /// All frames that came until the server has closed.
    std::vector<SeenFrame> finish() {
        std::error_code ignored;
        socket_.shutdown(asio::socket_base::shutdown_both, ignored);
        thread_.join();
        return std::move(frames_);
    }

  private:
    void read() {
        igtl::MessageParser parser(
            [](const igtl::Header& header) { return header.type == "STRING"; });
        std::array<std::uint8_t, 65536> buffer;
        std::error_code failure;
        while (const std::size_t size = socket_.read_some(asio::buffer(buffer), failure))
            parser.feed({buffer.data(), size}, [this](igtl::Message&& m) {
                const json frame = json::parse(std::get<igtl::String>(m.content).text);
                frames_.push_back({frame.at("sample"), steady_seconds(), frame.at("latency_ms")});
            });
    }
    asio::io_context io_;
    asio::ip::tcp::socket socket_{io_};
    std::vector<SeenFrame> frames_;
    std::thread thread_;
};

/// A recording as a tracker server sends it, from now on.
class TrackerServer {
  public:
    explicit TrackerServer(const Recording& recording)
        : playback_(recording, {.listener = [this, tools = recording.tools](const StreamSample& s) {
                        server_.publish(sample_messages(tools, s.sample, utc_seconds()));
                    }}) {
        (void)playback_.next();  // begins
    }
    std::uint16_t port() const { return server_.port(); }

  private:
    OpenIgtLinkServer server_{{"127.0.0.1", 0}};
    Playback playback_;
};

Scene published_scene(double budget_ms) {
    Scene scene = phantom_scene(TimeScheme::newmark);
    scene.track->publish = PublishOptions{.port = 0, .rate_Hz = 0};
    scene.track->budget = fmt::format("{} ms", budget_ms);
    return scene;
}

}  // namespace

int bench_latency(const LatencyArguments& arguments) {
    PetscSession session("livetet", {});
    if (session.ranks() > 1)
        fail("bench latency runs on one rank, found {}: start it without mpirun", session.ranks());
    MeshHierarchy hierarchy = [&] {
        ProgressLine progress("mesh");
        return mesh_phantom(make_phantom_images(0.0015, 1), {"", arguments.tets, 0, 0, 0},
                            progress.callback());
    }();
    SimulatedTrackerOptions tracker = phantom_tracker({.rate_Hz = arguments.rate_Hz});
    tracker.presses = 1 + static_cast<int>(arguments.seconds / 3);
    Scene scene = published_scene(arguments.budget_ms);
    SceneBody body = make_body(PETSC_COMM_SELF, scene, std::move(hierarchy), true);

    // The whole of `track`, its result included.
    const WorkFolder folder;
    ArrivalTimes came;
    FrameCounts counts;
    std::vector<SeenFrame> seen;
    {
        ResultWriter writer(folder / "result.h5", body.mesh(), to_yaml(scene), Precision::single);
        ArrivalLog arrivals;
        Recorder recorder(writer, body.body->linear_solver().kind(), arrivals);
        const TrackerServer server(simulate_press(tracker));
        OpenIgtLinkSourceOptions options;
        options.listener = [&](const StreamSample& sample) {
            came.keep(sample);
            arrivals.keep(sample);
        };
        OpenIgtLinkSource source("127.0.0.1", server.port(), {"Reference", "Sensor"}, options);
        LiveModel model(
            scene, body, [&](const std::string& tool) { return source.index_of(tool); },
            tracker.image_from_reference, true);
        Announcer announcer(body.mesh(), source, 0, scene.track->publish);
        FrameReader reader(announcer.port());
        const Interruptible interruptible;
        const FramePlan plan{.budget_s = arguments.budget_ms / 1e3,
                             .seconds = arguments.seconds + settling_s,
                             .clock = SampleClock::arrival};
        run_frames(scene, source, model, &recorder, announcer, nullptr, plan, counts);
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
        seen = reader.finish();
    }

    std::vector<double> whole, computed, told;
    const double first = seen.empty() ? 0 : seen.front().seen_s;
    for (const SeenFrame& frame : seen) {
        if (frame.seen_s - first < settling_s) continue;
        const double ms = 1e3 * (frame.seen_s - came.of(frame.sample));
        whole.push_back(ms);
        computed.push_back(frame.computed_ms);
        told.push_back(ms - frame.computed_ms);
    }
    if (whole.empty()) fail("bench latency: no frame came back in {} s", arguments.seconds);
    const Distribution all = distribution(whole), compute = distribution(computed),
                       tell = distribution(told);
    fmt::print(
        "{} tets, a tracker of {:g} Hz, budget {:g} ms, every frame published: {} of {} samples "
        "computed, {} frames seen "
        "by a client\n\n",
        body.mesh().tets.size(), arguments.rate_Hz, arguments.budget_ms, counts.frames,
        counts.samples, seen.size());
    fmt::print("{}{}{}{}", distribution_heads("ms"),
               distribution_row("from a message's arrival to the client", all),
               distribution_row("  until the frame is computed", compute),
               distribution_row("  surface, tools, status: built, sent, read", tell));
    const bool held = all.median < median_allowed_ms && all.p99 < p99_allowed_ms;
    fmt::print("\nasked for: median under {:g} ms, 99 % under {:g} ms: {}\n", median_allowed_ms,
               p99_allowed_ms, held ? "held" : "MISSED");
    if (!arguments.json.empty())
        write_text_file(arguments.json, json{{"tets", body.mesh().tets.size()},
                                             {"rate_Hz", arguments.rate_Hz},
                                             {"budget_ms", arguments.budget_ms},
                                             {"samples", counts.samples},
                                             {"frames", counts.frames},
                                             {"missed", counts.missed},
                                             {"latency_ms", json_of(all)},
                                             {"computed_ms", json_of(compute)},
                                             {"told_ms", json_of(tell)}}
                                                .dump(2) +
                                            "\n");
    return held ? 0 : 1;
}

}  // namespace livetet
