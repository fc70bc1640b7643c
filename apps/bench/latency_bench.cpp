#define ASIO_STANDALONE
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <asio.hpp>
#include <chrono>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/bench/benchmarks.hpp"
#include "apps/bench/distribution_table.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/realtime_cases.hpp"
#include "apps/live/frame_loop.hpp"
#include "apps/live/tracker_server.hpp"
#include "apps/phantom/phantom.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/stop_signals.hpp"
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

struct LatencyArguments {
    double seconds = 30;
    double rate_Hz = 40;  ///< sampling rate of the tracker
    int tets = 60000;
    double budget_ms = 10;
    std::filesystem::path json;
};

constexpr double median_allowed_ms = 15, p99_allowed_ms = 25;
constexpr double settling_s = 3;  // until sensors are placed and buffers have grown

/// Arrival times of samples.
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

/// A frame as seen by a client: arrival of its last message, and the computing time it states.
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
    /// All frames until the server closed the connection.
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

/// A tracker server that plays a recording from now on.
class TrackerServer {
  public:
    explicit TrackerServer(const Recording& recording)
        : playback_(recording, {.listener = [this, tools = recording.tools](const StreamSample& s) {
                        server_.publish(sample_messages(tools, s.sample, utc_seconds()));
                    }}) {
        (void)playback_.next();  // starts the playback
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

/// Measurements of a run.
struct LatencyRun {
    ArrivalTimes came;
    FrameCounts counts;
    std::vector<SeenFrame> seen;
};

/// Runs all of `track`, with its result file, between a tracker server and a client.
void run_published(const LatencyArguments& arguments, SceneBody& body, Scene& scene,
                   const SimulatedTrackerOptions& tracker, LatencyRun& run) {
    const WorkFolder folder;
    ResultWriter writer(folder / "result.h5", body.mesh(), to_yaml(scene), Precision::single);
    ArrivalLog arrivals;
    Recorder recorder({.result = &writer}, body.body->linear_solver().kind(), arrivals);
    const TrackerServer server(simulate_press(tracker));
    OpenIgtLinkSourceOptions options;
    options.listener = [&](const StreamSample& sample) {
        run.came.keep(sample);
        arrivals.keep(sample);
    };
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Reference", "Sensor"}, options);
    TrackedBody tracked(
        scene, body, [&](const std::string& tool) { return source.index_of(tool); },
        tracker.image_from_reference, MisplacedSensor::wait);
    ProgressLine line("track");
    FramePublisher publisher(body.mesh(), source, 0, scene.track->publish, line.status());
    FrameReader reader(publisher.port());
    const StopSignals signals;
    const FramePlan plan{.budget_s = arguments.budget_ms / 1e3,
                         .length_s = arguments.seconds + settling_s,
                         .stop = signals.token(),
                         .clock = SampleClock::arrival};
    run_frames(scene, source, tracked, &recorder, publisher, nullptr, plan, run.counts);
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    run.seen = reader.finish();
}

/// Prints a table and writes the file. True if both targets hold.
bool report_latency(const LatencyArguments& arguments, std::size_t tets, const LatencyRun& run) {
    std::vector<double> whole, computed, sent;
    const double first = run.seen.empty() ? 0 : run.seen.front().seen_s;
    for (const SeenFrame& frame : run.seen) {
        if (frame.seen_s - first < settling_s) continue;
        const double ms = 1e3 * (frame.seen_s - run.came.of(frame.sample));
        whole.push_back(ms);
        computed.push_back(frame.computed_ms);
        sent.push_back(ms - frame.computed_ms);
    }
    if (whole.empty()) fail("bench latency: no frame came back in {} s", arguments.seconds);
    const Distribution all = distribution(whole), compute = distribution(computed),
                       send = distribution(sent);
    fmt::print(
        "{} tets, tracker at {:g} Hz, budget {:g} ms, every frame published: {} of {} samples "
        "computed, {} frames seen by a client\n\n",
        tets, arguments.rate_Hz, arguments.budget_ms, run.counts.frames, run.counts.samples,
        run.seen.size());
    fmt::print("{}{}{}{}", distribution_heads("ms"),
               distribution_row("from a message's arrival to the client", all),
               distribution_row("  until the frame is computed", compute),
               distribution_row("  surface, tools, status: built, sent, read", send));
    const bool holds = all.median < median_allowed_ms && all.p99 < p99_allowed_ms;
    fmt::print("\ntarget: median below {:g} ms, 99 % below {:g} ms: {}\n", median_allowed_ms,
               p99_allowed_ms, holds ? "holds" : "MISSED");
    if (!arguments.json.empty())
        write_text_file(arguments.json, json{{"tets", tets},
                                             {"rate_Hz", arguments.rate_Hz},
                                             {"budget_ms", arguments.budget_ms},
                                             {"samples", run.counts.samples},
                                             {"frames", run.counts.frames},
                                             {"missed", run.counts.missed},
                                             {"latency_ms", json_of(all)},
                                             {"computed_ms", json_of(compute)},
                                             {"told_ms", json_of(send)}}
                                                .dump(2) +
                                            "\n");
    return holds;
}

/// Time from a tracker's message to the published frame that used it: a tracker server, `track`'s
/// frame loop with its recorder and its server, and a client that reads every frame, all over TCP
/// on this machine. Returns 1 if the median is above 15 ms or the 99th percentile above 25 ms.
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
    SceneBody body = make_body(PETSC_COMM_SELF, scene, std::move(hierarchy), Use::track);
    LatencyRun run;
    run_published(arguments, body, scene, tracker, run);
    return report_latency(arguments, body.mesh().tets.size(), run) ? 0 : 1;
}

}  // namespace

void add_latency_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "latency",
        "Time from a tracker's message to the published frame that used it, over TCP; exit "
        "status 1 if a target is missed");
    auto a = std::make_shared<LatencyArguments>();
    command->add_option("--for", a->seconds, "measured time, s")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command->add_option("--rate", a->rate_Hz, "tracker samples a second")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command->add_option("--tets", a->tets, "tets of the phantom's finest mesh")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command->add_option("--budget", a->budget_ms, "time budget of a frame, ms")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command->add_option("--json", a->json, "write the figures to this file");
    command->callback([a, &status] {
        check_output_files({a->json});
        status = bench_latency(*a);
    });
}

}  // namespace livetet
