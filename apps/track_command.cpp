#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/commands.hpp"
#include "apps/live_model.hpp"
#include "apps/report.hpp"
#include "base/file.hpp"
#include "base/ring.hpp"
#include "config/yaml.hpp"
#include "io/registration_file.hpp"
#include "io/result_file.hpp"
#include "io/sequence_file.hpp"
#include "solvers/petsc_session.hpp"
#include "tracking/mailbox.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

using nlohmann::json;

struct TrackArguments {
    std::filesystem::path scene, json;
    bool every_sample = false;
};

/// A frame with what it took, on its way to the file. A default one ends the stream.
struct KeptFrame {
    Frame frame;
    double seconds = 0;
    bool last = false;
};

/// Posts a recording's samples at their own pace; a negative index ends the stream.
class Player {
  public:
    explicit Player(const Recording& recording) : recording_(recording) {
        thread_ = std::jthread([this](std::stop_token stop) { play(stop); });
    }
    /// Sleeps until there is a sample that was not taken yet; its index, or -1 at the recording's end.
    int next() {
        for (;;) {
            const auto seen = mailbox_.posted();  // before `take`: whatever is posted after this wakes us
            if (mailbox_.take()) return mailbox_.incoming();
            mailbox_.wait_beyond(seen);
        }
    }

  private:
    void play(const std::stop_token& stop) {
        std::mutex mutex;
        std::unique_lock lock(mutex);
        std::condition_variable_any sleep;
        const auto start = Clock::now();
        const auto until = [&](double seconds) {  // wakes at once where the run ends early
            sleep.wait_until(
                lock, stop, start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)),
                [] { return false; });
        };
        const double first = recording_.samples.front().time_s;
        for (std::size_t i = 0; i < recording_.samples.size() && !stop.stop_requested(); ++i) {
            until(recording_.samples[i].time_s - first);
            post(static_cast<int>(i));
        }
        until(recording_.samples.back().time_s - first + 0.2);  // the last sample is still a frame
        post(-1);
    }
    void post(int index) {
        mailbox_.outgoing() = index;
        mailbox_.post();
    }

    const Recording& recording_;
    Mailbox<int> mailbox_;
    std::jthread thread_;
};

/// Writes frames from a thread of its own, so that the simulation never waits for a disk.
class Recorder {
  public:
    /// `solver`: what computed the frames; the live one alone estimates their errors.
    Recorder(ResultWriter& writer, SolverKind solver) : writer_(writer), solver_(solver), ring_(32) {
        thread_ = std::thread([this] { run(); });
    }
    ~Recorder() {
        if (thread_.joinable()) finish();
    }
    /// False where the disk is a whole ring behind: the frame is not kept.
    bool keep(const Frame& frame, double seconds) {
        KeptFrame* slot = ring_.free_slot();
        if (!slot) return false;
        slot->frame = frame;
        slot->seconds = seconds;
        slot->last = false;
        ring_.push();
        return true;
    }
    /// Whether writing has failed: `close` will throw why.
    bool failed() const { return failed_.load(std::memory_order_acquire); }
    /// Waits until all is written. Throws what the writing thread met.
    void close() {
        finish();
        if (failure_) std::rethrow_exception(failure_);
    }

  private:
    void finish() {
        KeptFrame* slot = nullptr;
        while (!(slot = ring_.free_slot())) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        slot->last = true;
        ring_.push();
        thread_.join();
    }
    void run() {
        for (;;) {
            const KeptFrame* kept = ring_.oldest();
            if (!kept) {
                ring_.wait();
                continue;
            }
            if (kept->last) return;
            try {
                if (!failure_) write(*kept);
            } catch (...) {
                failure_ = std::current_exception();
                failed_.store(true, std::memory_order_release);
            }
            ring_.pop();
        }
    }
    void write(const KeptFrame& kept) {
        const Frame& f = kept.frame;
        writer_.append(f.time_s, f.displacement);
        std::vector<double> pose;
        for (int i = 0; i < 3; ++i) {
            for (int k = 0; k < 3; ++k) pose.push_back(f.tracker_from_image.rotation(i, k));
            pose.push_back(f.tracker_from_image.translation[i]);
        }
        writer_.append_values("tracker_from_image", pose);
        const auto value = [&](const char* name, double x) { writer_.append_values(name, {{x}}); };
        value("frame_ms", 1e3 * kept.seconds);
        value("sensor_ms", 1e3 * f.sensor_s);
        value("forces_ms", 1e3 * f.step.forces_s);
        value("operator_ms", 1e3 * f.step.operator_s);
        value("solve_ms", 1e3 * f.step.solve_s);
        value("finish_ms", 1e3 * f.step.finish_s);
        value("output_ms", 1e3 * f.output_s);
        value("iterations", f.step.iterations);
        value("imbalance", f.step.imbalance);
        value("residual", f.step.linear_residual);
        if (solver_ == SolverKind::live) value("error_estimate_mm", 1e3 * f.step.solve_error);
        value("cut_short", f.step.cut_short && f.step.converged);  // else it failed, budget or not
        value("press_mm", 1e3 * f.press);
        value("registration_status", static_cast<double>(f.registration));
        value("drive_status", static_cast<double>(f.drive));
        value("converged", f.step.converged);
    }

    ResultWriter& writer_;
    SolverKind solver_;
    Ring<KeptFrame> ring_;
    std::exception_ptr failure_;
    std::atomic<bool> failed_{false};
    std::thread thread_;
};

struct Counts {
    std::size_t frames = 0, missed = 0, not_kept = 0, not_converged = 0;
};

/// What the line of progress says of a frame.
std::string describe_frame(const Frame& frame, double seconds, SolverKind solver) {
    std::string text = fmt::format("{:6.1f} ms, {:2} iterations, residual {:.0e}", 1e3 * seconds, frame.step.iterations,
                                   frame.step.linear_residual);
    if (solver == SolverKind::live) text += fmt::format(", error {:.3f} mm", 1e3 * frame.step.solve_error);
    return text + fmt::format(", press {:4.1f} mm", 1e3 * frame.press);
}

/// Frame after frame to the recording's end; each is due `budget_s` after it began, if there is a budget.
Counts run_frames(const Scene& scene, const Recording& recording, LiveModel& model, Recorder& recorder,
                  std::optional<double> budget_s, SolverKind solver) {
    ProgressLine progress("track");
    Counts counts;
    const auto samples = static_cast<int>(recording.samples.size());
    const auto one_frame = [&](int index) {
        const auto start = Clock::now();
        std::optional<Clock::time_point> deadline;
        if (budget_s)
            deadline = start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(*budget_s));
        const Frame& frame = model.advance(recording.samples[index], {deadline});
        const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
        if (counts.frames % scene.output.every == 0) {
            bool kept = recorder.keep(frame, seconds);
            while (!kept && scene.track->pace == Pace::every_sample) {  // nothing is real time: wait for the disk
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
                kept = recorder.keep(frame, seconds);
            }
            counts.not_kept += !kept;
        }
        counts.not_converged += !frame.step.converged;
        ++counts.frames;
        progress.update(
            static_cast<double>(index + 1) / samples,
            fmt::format("frame {:5} {}", counts.frames, describe_frame(frame, seconds, solver)));
    };
    if (scene.track->pace == Pace::every_sample) {
        for (int i = 0; i < samples && !recorder.failed(); ++i) one_frame(i);
        return counts;
    }
    Player player(recording);
    int last = -1;
    for (int index; !recorder.failed() && (index = player.next()) >= 0; last = index) {
        counts.missed += index - last - 1;
        one_frame(index);
    }
    counts.missed += recorder.failed() ? 0 : samples - 1 - last;
    return counts;
}

/// The typical time between samples, s: what a frame may take where the scene has no budget.
double sample_interval(const Recording& recording) {
    std::vector<double> gaps;
    for (std::size_t i = 1; i < recording.samples.size(); ++i)
        gaps.push_back(recording.samples[i].time_s - recording.samples[i - 1].time_s);
    if (gaps.empty()) return 0;
    std::nth_element(gaps.begin(), gaps.begin() + gaps.size() / 2, gaps.end());
    return gaps[gaps.size() / 2];
}

json describe_run(const Recording& recording, const FiducialRegistration& registration, const SceneBody& body,
                  const Counts& counts, std::optional<double> budget_s) {
    const double interval_s = sample_interval(recording);
    json fiducials = json::array();
    for (const RegisteredFiducial& f : registration.fiducials)
        fiducials.push_back(
            {{"name", f.name}, {"residual_mm", 1e3 * f.residual}, {"leave_one_out_mm", 1e3 * f.leave_one_out}});
    return {{"samples", recording.samples.size()},
            {"frames", counts.frames},
            {"missed", counts.missed},
            {"not_kept", counts.not_kept},
            {"interval_ms", 1e3 * interval_s},
            {"budget_ms", 1e3 * budget_s.value_or(interval_s)},
            {"budget_given", budget_s.has_value()},
            {"fre_mm", 1e3 * registration.fre},
            {"fiducials", fiducials},
            {"tets", body.mesh().tets.size()},
            {"nodes", body.mesh().nodes.size()},
            {"levels", body.hierarchy.levels.size()},
            {"solver", body.body->elastic_operator().name()},
            {"version", LIVETET_VERSION}};
}

int track(const TrackArguments& arguments, const std::vector<std::string>& petsc) {
    // 1. what is asked: everything is read and checked before anything runs
    Scene scene = load_scene(arguments.scene);
    if (!scene.track)
        fail("{}: track is missing, expected the tracker's recording and registration (livetet scene lists its keys)",
             arguments.scene.string());
    const std::optional<double> budget_s = seconds_of(scene.track->budget);
    if (budget_s && resolved_formulation(elastic_model(scene, true)) == Formulation::mixed)
        fail("track.budget = {}: solves of the mixed form cannot be cut short, expected formulation: displacement ({})",
             scene.track->budget, arguments.scene.string());
    if (arguments.every_sample) scene.track->pace = Pace::every_sample;
    const Recording recording = read_sequence(scene.track->recording);
    for (const std::string& tool : {scene.track->reference_tool, scene.track->sensor_tool})
        naming(scene.track->recording.string(), [&] { return tool_index(recording, tool); });
    const FiducialRegistration registration = read_registration(scene.track->registration);
    const auto& image_from_base = registration.image_from_base;
    if (std::abs(image_from_base.scale - 1) > 1e-9)
        fail("{}: has a scale of {:.5f}, expected a rigid registration (livetet register without --scale)",
             scene.track->registration.string(), image_from_base.scale);
    if (registration.reference_tool != scene.track->reference_tool)
        fail("{}: registered in the frame of {}, expected the reference sensor {} (livetet register --reference {})",
             scene.track->registration.string(),
             registration.reference_tool.empty() ? "the tracker" : registration.reference_tool,
             scene.track->reference_tool, scene.track->reference_tool);

    // 2. mesh, body, model
    PetscSession session("livetet", petsc);
    if (session.ranks() > 1) fail("track runs on one rank, found {}: start it without mpirun", session.ranks());
    session.add_options(scene.solver.petsc_options);
    MeshHierarchy hierarchy = [&] {
        ProgressLine progress("mesh");
        return load_mesh(scene.mesh, progress.callback());
    }();
    SceneBody body = make_body(PETSC_COMM_SELF, scene, std::move(hierarchy), true);
    LiveModel model(scene, body, recording.tools, {image_from_base.rotation, image_from_base.translation});

    // 3. frames
    ResultWriter writer(scene.output.file, body.mesh(), to_yaml(scene), Precision::single);
    const SolverKind solver = body.body->elastic_operator().kind();
    Recorder recorder(writer, solver);
    const Counts counts = run_frames(scene, recording, model, recorder, budget_s, solver);
    recorder.close();
    writer.write_text("run", describe_run(recording, registration, body, counts, budget_s).dump());
    writer.close();

    // 4. report
    report_result(scene.output.file, arguments.json);
    return counts.not_converged == 0 ? 0 : 3;
}

}  // namespace

void add_track_command(CLI::App& app, ExitStatus& status) {
    CLI::App* command =
        app.add_subcommand("track", "Follows a tracker in real time: registration, deformation, results, report");
    command->footer(
        "Other options with one dash go to PETSc: -ksp_view, -log_view, -ksp_monitor ...\nThe keys of a scene: livetet "
        "scene.");
    auto arguments = std::make_shared<TrackArguments>();
    command->add_option("scene", arguments->scene, "scene file (YAML) with a track section")->required();
    command->add_flag("--every-sample", arguments->every_sample,
                      "every sample of the recording, however long it takes, instead of its own pace");
    command->add_option("--json", arguments->json, "write the report to this file too");
    command->allow_extras();
    command->callback([command, arguments, &status] { status.value = track(*arguments, petsc_arguments(*command)); });
}

}  // namespace livetet
