#include <fmt/format.h>

#include <memory>
#include <optional>

#include "apps/commands/commands.hpp"
#include "apps/commands/track_run.hpp"
#include "apps/plots/virtual_display.hpp"
#include "apps/scene/outputs.hpp"
#include "apps/scene/targets.hpp"
#include "apps/viewer/player.hpp"
#include "apps/viewer/track_view.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/log.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

struct ViewArguments {
    TrackArguments track;  ///< if the input is a scene
    fs::path input, screenshot, script, record;
    ViewFiles files;
    std::optional<std::size_t> frame;
    std::string colour = "displacement";
    std::vector<int> size{1280, 800};
    double rate_Hz = 25;
    bool off_screen = false;

    bool is_scene() const {
        const std::string end = ending(input);
        return end == ".yaml" || end == ".yml";
    }
    bool needs_user() const { return screenshot.empty() && record.empty() && !off_screen; }
};

void tell_left_out(const ShownBody& body) {
    for (const std::string& line : body.left_out) log_info("left out: " + line);
}

std::optional<ViewScript> read_script(const ViewArguments& arguments) {
    if (arguments.script.empty()) return {};
    return ViewScript(read_text_file(arguments.script), arguments.script.string(),
                      [](const std::string& line) { fmt::print("{}\n", line); });
}

/// Tracks a scene with a window.
int view_scene(const ViewArguments& arguments, const std::vector<std::string>& petsc) {
    if (arguments.frame || !arguments.record.empty() || arguments.colour != ViewArguments{}.colour)
        fail(
            "view {}: --frame, --record and --colour are for recorded results (.h5); a run is "
            "recorded, and can be viewed then",
            arguments.input.string());
    const std::optional<ViewScript> script = read_script(arguments);
    return run_track(arguments.track, petsc,
                     [&](const Scene& scene, const TetMesh& mesh, const StopSource& stop) {
                         ShownBody body =
                             make_shown_body(mesh, scene, arguments.input, arguments.files);
                         if (!scene.track->targets.empty())
                             body.stated_places = surface_places(mesh);
                         tell_left_out(body);
                         std::optional<double> cut_depth;
                         if (scene.track->cut_by_hand_mm)
                             cut_depth = 1e-3 * *scene.track->cut_by_hand_mm;
                         return std::make_unique<TrackView>(
                             std::move(body), stop,
                             TrackView::Options{
                                 arguments.needs_user() ? Surface::on_screen : Surface::off_screen,
                                 {arguments.size[0], arguments.size[1]},
                                 script,
                                 arguments.screenshot,
                                 cut_depth});
                     });
}

int view_recording(const ViewArguments& arguments) {
    // 1. inputs
    const std::optional<ViewScript> script = read_script(arguments);
    const ViewRecording recording(arguments.input, arguments.files);
    if (arguments.frame && (*arguments.frame < 1 || *arguments.frame > recording.times_s().size()))
        fail("--frame {}: {} holds {}, expected 1 to {}", *arguments.frame,
             arguments.input.string(), counted(recording.times_s().size(), "frame"),
             recording.times_s().size());
    if (arguments.colour == "stress" && !recording.has_stress())
        fail(
            "--colour stress: {} holds no von_mises, expected a solve with output: {{fields: "
            "[von_mises]}}",
            arguments.input.string());
    if (arguments.colour == "error" && !recording.states_errors())
        fail(
            "--colour error: {} holds no errors over the surface, expected the result of a scene "
            "with track.targets",
            arguments.input.string());
    tell_left_out(recording.body());

    // 2. window
    ViewWindow window(recording.body(),
                      arguments.needs_user() ? Surface::on_screen : Surface::off_screen,
                      {arguments.size[0], arguments.size[1]});
    Player player(recording, window);
    if (arguments.frame)
        player.go_to_frame(*arguments.frame - 1);
    else if (!arguments.screenshot.empty())
        player.go_to_frame(recording.representative_frame());
    const auto& sensors = window.shown().sensors;
    if (!sensors.empty() && sensors.front().base) window.set_cross(*sensors.front().base);
    if (arguments.colour == "stress") window.set_colour(ColourBy::von_mises);
    if (arguments.colour == "error") window.set_colour(ColourBy::stated_error);

    // 3. outputs
    if (script) script->run(window, player.stage());
    if (!arguments.screenshot.empty()) {
        window.write_png(arguments.screenshot);
        fmt::print("written      {}\n", arguments.screenshot.string());
    }
    if (!arguments.record.empty()) {
        ProgressLine progress("record");
        player.record(arguments.record, arguments.rate_Hz, progress.callback());
    }
    if (arguments.needs_user() && !script) player.run();
    return 0;
}

/// Handles a missing X server: starts one without a screen unless a user is needed.
void do_without_screen(const ViewArguments& arguments) {
    if (arguments.needs_user() && arguments.is_scene())
        fail(
            "view {}: no X server answers (DISPLAY), expected one for the window; livetet track "
            "follows the scene without, and "
            "--screenshot FILE.png draws a picture at the end",
            arguments.input.string());
    if (arguments.needs_user())
        fail(
            "view {}: no X server answers (DISPLAY), expected one for the window; --screenshot "
            "FILE.png draws a picture without",
            arguments.input.string());
    need_display(fmt::format("view {}", arguments.input.string()));
}

}  // namespace

void add_view_command(CLI::App& app, ExitStatus& status) {
    CLI::App* command = app.add_subcommand("view",
                                           "Shows a recorded result, or a scene while it is "
                                           "tracked: the organ, and slices of its image");
    auto arguments = std::make_shared<ViewArguments>();
    command
        ->add_option("input", arguments->input,
                     "a result of livetet track or solve (.h5), or a scene (.yaml) to track")
        ->required();
    command->add_option("--image", arguments->files.image,
                        "grey image for the slices, instead of the one that the scene names");
    command->add_option("--surface", arguments->files.surface,
                        "a finer surface of the organ (.stl, .ply, .vtp ..., mm, RAS), moved with "
                        "the mesh; default: the mesh's own, subdivided");
    command->add_option("--frame", arguments->frame, "first frame to show, counted from 1");
    command->add_option("--colour", arguments->colour, "quantity that colours the surface")
        ->check(CLI::IsMember({"displacement", "stress", "error"}))
        ->capture_default_str();
    command->add_option("--size", arguments->size, "size of the window, pixels")
        ->expected(2)
        ->check(CLI::Range(200, 8000));
    command->add_option("--screenshot", arguments->screenshot,
                        "no window: draw a picture (.png), of the deepest press unless --frame or "
                        "--script say otherwise");
    command->add_option(
        "--record", arguments->record,
        "no window: draw the whole recording, as a video (.ogv) or a folder of pictures");
    command->add_option("--rate", arguments->rate_Hz, "pictures a second of --record")
        ->check(CLI::Range(1.0, 100.0))
        ->capture_default_str();
    command->add_option("--script", arguments->script,
                        "run the commands of this file (listed below), then exit");
    command->add_flag("--off-screen", arguments->off_screen, "no window: for --script");
    command->footer("A script has one command a line:\n" + ViewScript::reference());
    add_track_options(*command, arguments->track);
    command->allow_extras();
    command->callback([command, arguments, &status] {
        const std::vector<std::string> petsc = petsc_arguments(*command);
        if (!arguments->is_scene() &&
            (!petsc.empty() || !arguments->track.publish.empty() || arguments->track.length_s ||
             arguments->track.every_sample || !arguments->track.json.empty()))
            fail(
                "view {}: --publish, --for, --every-sample, --json and PETSc's options are for a "
                "scene (.yaml)",
                arguments->input.string());
        expect_ending("--screenshot", arguments->screenshot, ".png");
        if (arguments->off_screen && arguments->script.empty() && arguments->screenshot.empty() &&
            arguments->record.empty())
            fail(
                "--off-screen: nobody would see it, expected --script, --screenshot or --record "
                "with it");
        arguments->track.scene = arguments->input;
        set_log_prefix("view");
        if (!have_display()) do_without_screen(*arguments);
        status.value =
            arguments->is_scene() ? view_scene(*arguments, petsc) : view_recording(*arguments);
    });
}

}  // namespace livetet
