#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <nlohmann/json.hpp>

#include "apps/bench/benchmarks.hpp"
#include "apps/bench/distribution_table.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/realtime_cases.hpp"
#include "apps/phantom/phantom.hpp"
#include "apps/plots/virtual_display.hpp"
#include "apps/viewer/track_view.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/stop_signals.hpp"
#include "base/work_folder.hpp"
#include "config/yaml.hpp"
#include "io/result_file.hpp"
#include "solvers/parallel/petsc_session.hpp"
#include "tracking/playback.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {

namespace {

using nlohmann::json;

struct ViewBenchArguments {
    double seconds = 6;   ///< duration of each stretch, s
    int stretches = 5;    ///< number of stretches with the window, and as many without
    double rate_Hz = 40;  ///< sampling rate of the tracker
    double budget_ms = 10;
    int tets = 60000;
    std::filesystem::path json;
};

constexpr double pictures_asked = 25;  // pictures a second
constexpr double opening_s = 4;        // until the sensor is placed and the window is open

/// Passes frames to a window in every other stretch of time, and times all of them.
class ByTurns : public FrameObserver {
  public:
    ByTurns(TrackView& view, const StopSource& stop, double stretch_s, int stretches)
        : view_(view), stop_(stop), stretch_s_(stretch_s), count_(2 * stretches) {}

    std::optional<HandPull> pull() override {
        began_s_ = steady_seconds();
        return {};
    }
    void on_frame(const Frame& frame, const TrackedBody& tracked,
                  const StreamSample& sample) override {
        const double now = steady_seconds();
        if (first_s_ == 0) first_s_ = now;
        const int stretch = now - first_s_ < opening_s
                                ? 0
                                : 1 + static_cast<int>((now - first_s_ - opening_s) / stretch_s_);
        const bool with = stretch % 2 == 0;  // stretch 0, which is not counted, too
        if (stretch != stretch_) {
            if (stretch_ > 0 && stretch_ % 2 == 0)
                pictures_a_second.push_back(static_cast<double>(view_.pictures() - pictures_) /
                                            (now - since_s_));
            stretch_ = stretch;
            since_s_ = now;
            pictures_ = view_.pictures();
        }
        if (stretch > count_) {
            (void)stop_.request_stop();
            return;
        }
        if (with) view_.on_frame(frame, tracked, sample);
        if (stretch == 0 || now - since_s_ < 0.5) return;  // skips pictures in progress
        (with ? with_ms : without_ms).push_back(1e3 * (now - began_s_));
        if (with) picture_ms.push_back(1e3 * view_.picture_s());
    }

    std::vector<double> pictures_a_second, picture_ms, with_ms, without_ms;

  private:
    TrackView& view_;
    const StopSource stop_;
    double stretch_s_;
    int count_, stretch_ = 0;
    double first_s_ = 0, since_s_ = 0, began_s_ = 0;
    std::size_t pictures_ = 0;
};

/// A run on the phantom with a window, off screen at 1280 x 800, that draws in alternate stretches:
/// pictures a second, time of a picture, and frame times with and without. Returns 1 if there are
/// fewer than 25 pictures a second.
int bench_view(const ViewBenchArguments& arguments) {
    PetscSession session("livetet", {});
    if (session.ranks() > 1)
        fail("bench view runs on one rank, found {}: start it without mpirun", session.ranks());
    const PhantomImages images = make_phantom_images(0.0015, 1);
    MeshHierarchy hierarchy = [&] {
        ProgressLine progress("mesh");
        return mesh_phantom(images, {"", arguments.tets, 0, 0, 0}, progress.callback());
    }();
    SimulatedTrackerOptions tracker = phantom_tracker({.rate_Hz = arguments.rate_Hz});
    const double whole_s = opening_s + 2 * arguments.stretches * arguments.seconds + 2;
    tracker.presses = 1 + static_cast<int>(whole_s / 3);
    Scene scene = phantom_scene(TimeScheme::newmark);
    SceneBody body = make_body(PETSC_COMM_SELF, scene, std::move(hierarchy), Use::track);

    ShownBody shown;
    set_mesh(shown, body.mesh());
    shown.image = images.image;
    shown.fixed = body.mesh().node_sets.at("fixed");
    const std::size_t triangles = shown.surface.triangles.size();

    const WorkFolder folder;
    FrameCounts counts;
    const StopSignals signals;
    TrackView view(std::move(shown), signals.source(), {.surface = Surface::off_screen});
    ByTurns turns(view, signals.source(), arguments.seconds, arguments.stretches);
    {
        ResultWriter writer(folder / "result.h5", body.mesh(), to_yaml(scene), Precision::single);
        ArrivalLog arrivals;
        Recorder recorder({.result = &writer}, body.body->linear_solver().kind(), arrivals);
        Playback source(simulate_press(tracker),
                        {.listener = [&](const StreamSample& s) { arrivals.keep(s); }});
        TrackedBody tracked(
            scene, body, [&](const std::string& tool) { return source.index_of(tool); },
            tracker.image_from_reference, MisplacedSensor::wait);
        FramePublisher publisher(body.mesh(), source, 0, {});
        run_frames(
            scene, source, tracked, &recorder, publisher, nullptr,
            {.budget_s = 1e-3 * arguments.budget_ms, .stop = signals.token(), .observer = &turns},
            counts);
    }
    view.finish();
    if (turns.pictures_a_second.empty()) fail("bench view: no picture was drawn in {} s", whole_s);

    const Distribution pictures = distribution(turns.pictures_a_second),
                       picture = distribution(turns.picture_ms), with = distribution(turns.with_ms),
                       without = distribution(turns.without_ms);
    const double least =
        *std::min_element(turns.pictures_a_second.begin(), turns.pictures_a_second.end());
    fmt::print(
        "{} tets, {} triangles drawn, three slices, 1280 x 800; a tracker of {:g} Hz, a budget of "
        "{:g} ms, {} of {} samples computed\n\n",
        body.mesh().tets.size(), triangles, arguments.rate_Hz, arguments.budget_ms, counts.frames,
        counts.samples);
    fmt::print("{}{}{}{}", distribution_heads("ms"), distribution_row("a picture", picture),
               distribution_row("a frame of the simulation, window", with),
               distribution_row("  without", without));
    fmt::print(
        "\n{:.1f} pictures a second in the median of {} stretches of {:g} s, {:.1f} in the worst; "
        "the window costs the "
        "simulation {:+.2f} ms a frame in the median\n",
        pictures.median, pictures.count, arguments.seconds, least, with.median - without.median);
    const bool holds = pictures.median >= pictures_asked;
    fmt::print("target: {:g} pictures a second: {}\n", pictures_asked, holds ? "holds" : "MISSED");
    if (!arguments.json.empty())
        write_text_file(arguments.json, json{{"tets", body.mesh().tets.size()},
                                             {"triangles", triangles},
                                             {"rate_Hz", arguments.rate_Hz},
                                             {"budget_ms", arguments.budget_ms},
                                             {"frames", counts.frames},
                                             {"samples", counts.samples},
                                             {"pictures_a_second", turns.pictures_a_second},
                                             {"picture_ms", json_of(picture)},
                                             {"frame_with_ms", json_of(with)},
                                             {"frame_without_ms", json_of(without)}}
                                                .dump(2) +
                                            "\n");
    return holds ? 0 : 1;
}

}  // namespace

void add_view_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "view",
        "Pictures a second of the window beside a run, and what it costs the simulation; exit "
        "status 1 if the target is missed");
    auto a = std::make_shared<ViewBenchArguments>();
    command->add_option("--for", a->seconds, "duration of each stretch, s")
        ->capture_default_str()
        ->check(CLI::Range(1.0, 1000.0));
    command
        ->add_option("--stretches", a->stretches,
                     "number of stretches with the window, and as many without")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    command->add_option("--rate", a->rate_Hz, "tracker samples a second")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command->add_option("--budget", a->budget_ms, "time budget of a frame, ms")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command->add_option("--tets", a->tets, "tets of the phantom's finest mesh")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command->add_option("--json", a->json, "write the figures to this file");
    command->callback([a, &status] {
        check_output_files({a->json});
        need_display("bench view");
        status = bench_view(*a);
    });
}

}  // namespace livetet
