#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/commands/commands.hpp"
#include "apps/commands/moved_targets.hpp"
#include "apps/commands/publish_option.hpp"
#include "apps/commands/report_result.hpp"
#include "apps/commands/track_run.hpp"
#include "apps/live/frame_loop.hpp"
#include "apps/live/replay.hpp"
#include "apps/live/statement_record.hpp"
#include "apps/live/track_inputs.hpp"
#include "apps/live/tracked_model.hpp"
#include "apps/live/tracker_source.hpp"
#include "apps/report/report.hpp"
#include "apps/scene/model_limits.hpp"
#include "apps/scene/outputs.hpp"
#include "base/counted.hpp"
#include "base/file.hpp"
#include "base/log.hpp"
#include "base/stop_signals.hpp"
#include "config/yaml.hpp"
#include "geometry/matrix_rows.hpp"
#include "io/registration_file.hpp"
#include "io/result_file.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

using nlohmann::json;

/// Summary of the cuts; zeros if nothing was cut.
json cuts_json(const FrameState& last) {
    const CutMesh none, &cut = last.cut ? *last.cut : none;
    return {{"openings", cut.openings},
            {"parted", cut.parted},
            {"nodes_added", cut.originals.size()},
            {"pieces", cut.pieces},
            {"free_pieces", cut.free_pieces},
            {"longest_ms", 1e3 * cut.longest_s},
            {"prepared_ms", 1e3 * cut.prepared_s},
            {"gaps", last.blade_gaps.count},
            {"gaps_mm", 1e3 * last.blade_gaps.length},
            {"waits", last.cut_waits}};
}

json describe_run(const OpenSource& open, const FiducialRegistration& registration,
                  const SceneBody& body, const TrackedBody& tracked, const FrameCounts& counts,
                  std::optional<double> budget_s, const std::string& problem) {
    const double interval_s = open.interval_s > 0 ? open.interval_s : counts.intervals.median_s();
    json fiducials = json::array();
    for (const RegisteredFiducial& f : registration.fiducials)
        fiducials.push_back({{"name", f.name},
                             {"residual_mm", 1e3 * f.residual},
                             {"leave_one_out_mm", 1e3 * f.leave_one_out}});
    json about = {{"samples", counts.samples},
                  {"frames", counts.frames},
                  {"missed", counts.missed},
                  {"not_kept", counts.not_kept},
                  {"problem", problem},
                  {"interval_ms", 1e3 * interval_s},
                  {"mean_interval_ms", 1e3 * counts.intervals.mean_s()},
                  {"budget_ms", 1e3 * budget_s.value_or(interval_s)},
                  {"budget_given", budget_s.has_value()},
                  {"poses", json_of(pose_qualities(tracked.tools(), tracked.last()))},
                  {"fre_mm", 1e3 * registration.fre},
                  {"fiducials", fiducials},
                  {"tets", body.mesh().tets.size()},
                  {"nodes", body.mesh().nodes.size()},
                  {"levels", std::max<std::size_t>(body.hierarchy.levels.size(),
                                                   body.body->linear_solver().level_count())},
                  {"solver", body.body->linear_solver().name()},
                  {"version", LIVETET_VERSION}};
    if (tracked.is_cutting()) about["cuts"] = cuts_json(tracked.last());
    return about;
}

/// What a run needs, read and checked before anything runs.
struct TrackInputs {
    explicit TrackInputs(const TrackArguments& arguments);

    std::filesystem::file_time_type written;  ///< of the scene file
    Scene scene;
    bool every_sample = false;
    std::optional<double> budget_s;
    FiducialRegistration registration;
    RigidTransform<ImageFrame, Reference> image_from_reference;
    ArrivalLog arrivals;
    OpenSource open;
};

Scene load_track_scene(const TrackArguments& arguments) {
    Scene scene = load_scene(arguments.scene);
    if (!scene.track)
        fail(
            "{}: track is missing, expected the tracker's source and registration (livetet scene "
            "lists its keys)",
            arguments.scene.string());
    refuse_to_overwrite("--json", arguments.json, scene, arguments.scene);
    if (!arguments.json.empty()) expect_writable(arguments.json);
    if (arguments.every_sample) scene.track->pace = Pace::every_sample;
    take_publish(arguments.publish, scene.track->publish);
    return scene;
}

std::filesystem::file_time_type write_time_of(const std::filesystem::path& file) {
    std::error_code gone;  // load_scene reports it
    return std::filesystem::last_write_time(file, gone);
}

TrackInputs::TrackInputs(const TrackArguments& arguments)
    : written(write_time_of(arguments.scene)),
      scene(load_track_scene(arguments)),
      every_sample(scene.track->pace == Pace::every_sample),
      budget_s(seconds_of(scene.track->budget)) {
    registration = read_registration(scene.track->registration);
    image_from_reference = rigid_registration(registration, *scene.track);
    open = open_source(
        scene.track->source, tools_of(*scene.track),
        {every_sample ? std::nullopt : std::optional(scene.track->speed),
         [this](const StreamSample& s) { arrivals.keep(s); }, scene.track->request_ms,
         " (track.sensors, by default Sensor, track.reference_tool and track.tools name "
         "the tools)"});
}

/// The data that replay_run needs.
json describe_replay(const TrackInputs& inputs, const SceneBody& body, const FrameCounts& counts) {
    const auto& image_from_reference = inputs.image_from_reference;
    const auto pose = matrix_rows(image_from_reference.rotation, image_from_reference.translation);
    json events = json::array();
    for (const SceneEvent& event : counts.events)
        events.push_back({{"frame", event.frame}, {"scene", event.scene}});
    json about = {{"threads", body.body->threads()},
                  {"tools", inputs.open.source->tools()},
                  {"image_from_reference", pose},
                  {"events", events}};
    if (const auto& error = inputs.registration.expected_error) {
        std::vector<double> numbers;  // to the bit
        for (const auto row : error->covariance.rowwise())
            numbers.insert(numbers.end(), row.begin(), row.end());
        about["registration_error"] = {{"covariance", numbers}, {"holds_tip", error->holds_tip}};
    }
    return about;
}

/// The files that a run writes while it goes on.
struct TrackFiles {
    TrackFiles(TrackInputs& inputs, const SceneBody& body);

    std::optional<ResultWriter> result;
    std::optional<ProbeHistory> probes;
    std::optional<Recorder> recorder;  ///< none: nothing is written
};

TrackFiles::TrackFiles(TrackInputs& inputs, const SceneBody& body) {
    const Scene& scene = inputs.scene;
    if (!scene.output.fields.empty())
        log_warning("output.fields: `track` keeps displacements only, `solve` writes fields");
    if (scene.output.has_file()) {
        result.emplace(scene.output.file, body.mesh(), to_yaml(scene), Precision::single);
        // Now, as a run that is killed cannot write it at its end.
        result->write_text("tools", json(inputs.open.source->tools()).dump());
    }
    if (scene.probes) probes.emplace(*scene.probes, body.mesh());
    if (result || probes)
        recorder.emplace(RecordedFiles{result ? &*result : nullptr, probes ? &*probes : nullptr},
                         body.body->linear_solver().kind(), inputs.arrivals);
}

/// The end of a run without a result file. Returns the exit status.
int finish_without_result(const Scene& scene, const FrameCounts& counts,
                          const std::optional<std::string>& problem) {
    if (counts.frames == 0) fail("{}: no sample came", scene.track->source);
    fmt::print("{}, {} missed, {} not converged; {} (output.file: none)\n",
               counted(counts.frames, "frame"), counted(counts.missed, "sample"),
               counted(counts.not_converged, "frame"),
               scene.probes ? scene.probes->displacements.string() + " and no result were written"
                            : "nothing was recorded");
    if (problem) fail("{}", *problem);
    return counts.not_converged == 0 ? 0 : 3;
}

/// Completes the result. `problem`: what ended the frames or their recording, if anything did.
void close_result(ResultWriter& writer, const TrackInputs& inputs, const SceneBody& body,
                  const TrackedBody& tracked, FrameCounts& counts,
                  const std::optional<std::string>& problem) {
    const Scene& scene = inputs.scene;
    if (inputs.arrivals.not_kept() > 0)
        log_warning(fmt::format("{} came faster than the disk could write: a replay may lack some",
                                counted(inputs.arrivals.not_kept(), "sample")));
    if (counts.came == 0) fail("{}: no pose of a tool came, nothing is kept", scene.track->source);
    const auto every = static_cast<std::size_t>(scene.output.every);
    counts.not_kept = (counts.frames + every - 1) / every - writer.frame_count();
    if (problem && writer.frame_count() == 0) fail("{}; nothing is kept", *problem);
    writer.write_text("run", describe_run(inputs.open, inputs.registration, body, tracked, counts,
                                          inputs.budget_s, problem.value_or(""))
                                 .dump(-1, ' ', false, json::error_handler_t::replace));
    writer.write_text("replay", describe_replay(inputs, body, counts).dump());
    writer.close();
}

}  // namespace

int run_track(const TrackArguments& arguments, const std::vector<std::string>& petsc,
              const ObserverMaker& make_observer) {
    // 1. inputs
    TrackInputs inputs(arguments);
    Scene& scene = inputs.scene;
    TrackerSource& source = *inputs.open.source;
    const bool streams = inputs.open.is_streaming();

    // 2. mesh, body, result
    PetscSession session("livetet", petsc);
    if (session.ranks() > 1)
        fail("track runs on one rank, found {}: start it without mpirun", session.ranks());
    session.add_options(scene.solver.petsc_options);
    MeshHierarchy hierarchy = [&] {
        ProgressLine progress("mesh");
        return load_mesh(scene, progress.callback());
    }();
    if (const auto note = locking_note(scene)) log_warning(*note);
    if (const auto note = swinging_note(scene, hierarchy.levels.front())) log_warning(*note);
    TrackedModel model = make_tracked_model(scene, std::move(hierarchy));
    const SceneBody& body = model.body;
    TrackFiles files(inputs, body);
    TrackedBody tracked = track_model(
        scene, model, [&](const std::string& tool) { return source.index_of(tool); },
        inputs.image_from_reference, inputs.registration.expected_error,
        streams ? MisplacedSensor::wait : MisplacedSensor::refuse,
        files.result || make_observer ? SurfaceErrors::stated : SurfaceErrors::left_out);
    if (files.result && !tracked.target_names().empty()) {
        files.result->write_text("targets", text_of_targets(tracked.target_names()));
        write_surface_places(*files.result, surface_places(body.mesh()));
    }

    // 3. frames
    const StopSignals signals;  // until all is written
    const std::unique_ptr<FrameObserver> observer =
        make_observer ? make_observer(scene, body.mesh(), signals.source()) : nullptr;
    FrameCounts counts;
    std::optional<std::string> problem;
    try {
        ProgressLine line("track");
        FramePublisher publisher(body.mesh(), source, inputs.open.samples, scene.track->publish,
                                 line.status());
        std::optional<SceneWatch> watch;
        if (!inputs.every_sample)
            watch.emplace(arguments.scene, inputs.written, scene, body.mesh());
        run_frames(scene, source, tracked, files.recorder ? &*files.recorder : nullptr, publisher,
                   watch ? &*watch : nullptr,
                   {inputs.budget_s, inputs.every_sample, arguments.length_s, signals.token(),
                    streams ? SampleClock::arrival : SampleClock::own, observer.get(),
                    streams ? 1 : scene.track->speed},
                   counts);
    } catch (const std::exception& error) {
        // Frames of a stream are kept: it does not come again.
        if (!streams || counts.frames == 0) throw;
        problem = error.what();
    }
    if (const auto not_written = files.recorder ? files.recorder->close() : std::nullopt;
        not_written && !problem)
        problem = not_written;
    if (files.probes && counts.frames > 0) files.probes->close();
    if (!files.result) return finish_without_result(scene, counts, problem);
    close_result(*files.result, inputs, body, tracked, counts, problem);

    // 4. report
    if (observer) observer->finish();  // two threads must not draw
    report_result(scene.output.file, arguments.json);
    session.tell_unused_options(PetscSession::Moment::end);
    if (problem)
        fail("{}; {} holds {} before that", *problem, scene.output.file.string(),
             counted(files.result->frame_count(), "frame"));
    return counts.not_converged == 0 ? 0 : 3;
}

namespace {

int replay(const TrackArguments& arguments, const std::vector<std::string>& petsc) {
    PetscSession session("livetet", petsc);
    session.add_options(petsc_options_of_run(arguments.replay));
    const ReplayReport report = [&] {
        ProgressLine progress("replay");
        return replay_run(arguments.replay, progress.callback());
    }();
    fmt::print("{}: {} of {} frames are the same to the bit", arguments.replay.string(),
               report.same, report.frames);
    if (report.same == report.frames) {
        fmt::print("\n");
        return 0;
    }
    fmt::print("; the first other one is frame {}, the largest gap {:.3g} mm\n", report.first_other,
               1e3 * report.largest_gap);
    for (const MovedTarget& target : moved_targets(arguments.replay))
        fmt::print("target {} is {:.3g} mm from where it was in this run\n", target.name,
                   target.distance_mm);
    return 3;
}

}  // namespace

void add_track_options(CLI::App& command, TrackArguments& arguments) {
    command.add_option("--publish", arguments.publish, publish_help);
    command.add_option("--for", arguments.length_s, "stop after this time in seconds")
        ->check(CLI::PositiveNumber);
    command.add_flag(
        "--every-sample", arguments.every_sample,
        "compute every sample of the recording, however long it takes, instead of its own pace");
    command.add_option("--json", arguments.json, "also write the report to this file");
}

void add_track_command(CLI::App& app, ExitStatus& status) {
    CLI::App* command = app.add_subcommand("track",
                                           "Follows a tracker in real time: registration, "
                                           "deformation, results, report. Ctrl-C ends it");
    command->footer(
        "Exit status 3: frames of a run did not converge, or frames of a replay are not the same.\n"
        "Other options with one dash go to PETSc: -ksp_view, -log_view, -ksp_monitor ...\nThe keys "
        "of a scene: livetet scene.");
    auto arguments = std::make_shared<TrackArguments>();
    CLI::Option* scene =
        command->add_option("scene", arguments->scene, "scene file (YAML) with a track section");
    command
        ->add_option("--replay", arguments->replay,
                     "recompute a recorded run (.h5) from its received samples, and compare each "
                     "frame bit by bit; exit status 3 if any differs")
        ->excludes(scene);
    add_track_options(*command, *arguments);
    command->allow_extras();
    command->callback([command, arguments, &status] {
        if (arguments->scene.empty() && arguments->replay.empty())
            fail("track: expected a scene file (YAML), or --replay RESULT.h5");
        const std::vector<std::string> petsc = petsc_arguments(*command);
        set_log_prefix("track");
        status.value =
            arguments->replay.empty() ? run_track(*arguments, petsc) : replay(*arguments, petsc);
    });
}

}  // namespace livetet
