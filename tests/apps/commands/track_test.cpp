#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "apps/commands/tracked_block.hpp"
#include "apps/live/recorder.hpp"
#include "apps/live/statement_record.hpp"
#include "base/file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/result_file.hpp"
#include "io/sequence_file.hpp"
#include "io/text.hpp"
#include "io/tip_file.hpp"
#include "mesh/barycentric_map.hpp"
#include "mesh/hierarchy.hpp"
#include "support/hex_grids.hpp"
#include "support/program.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using test::largest;
using test::livetet;
using test::Tracked;
using test::write_text;

TEST(Track, MovingTheWholeOrganDeformsNothingAndTheSensorIsFollowed) {
    Tracked t;
    t.tracker.position_rms_mm = t.tracker.rotation_rms_deg = 0;
    t.record();
    const ResultReader result = t.run();
    ASSERT_EQ(result.frame_count(), t.recording.samples.size());
    double travelled = 0, deepest = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const double time = result.times_s()[k], depth = true_press_depth(t.tracker, time);
        travelled = std::max(travelled, (true_tracker_from_image(t.tracker, time).translation -
                                         true_tracker_from_image(t.tracker, 0).translation)
                                            .norm());
        if (time < t.tracker.rest_s) {
            ASSERT_LT(largest(result.displacement(k)), 1e-7)
                << "at " << time << " s nothing pressed yet";
        }
        deepest = std::max(deepest, result.values("press_mm", k, 1)[0]);
        ASSERT_NEAR(result.values("press_mm", k, 1)[0], 1e3 * depth, 4) << "at " << time << " s";
    }
    EXPECT_GT(travelled, 0.03);
    EXPECT_NEAR(deepest, 15, 0.5);
    EXPECT_LT(largest(result.displacement(result.frame_count() - 1)), 1e-3)
        << "released, it comes home";
}

TEST(Track, WithATrackersNoiseAndNothingPressedItMovesNoMoreThanTheNoise) {
    Tracked t;
    t.tracker.press_depth = 0;
    t.record();
    const ResultReader result = t.run();
    // The sensor in the image by two noisy poses: position errors of both, and the reference's turn
    // over their distance.
    const double lever = (t.tracker.image_from_sensor_at_rest.translation -
                          t.tracker.image_from_reference.translation)
                             .norm();
    const double noise =
        std::sqrt(2 * std::pow(1.4e-3, 2) + 2.0 / 3 * std::pow(0.5 * M_PI / 180 * lever, 2));
    double squares = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const double moved = largest(result.displacement(k));
        EXPECT_LT(moved, 3 * noise);
        squares += moved * moved / static_cast<double>(result.frame_count());
    }
    EXPECT_LT(std::sqrt(squares), noise);
    EXPECT_GT(std::sqrt(squares), 0.05 * noise) << "noise came in, else this test shows nothing";
}

TEST(Track, ALostOrMadSensorNeverMakesTheModelExplode) {
    Tracked t;
    t.record();
    const std::size_t sensor = tool_index(t.recording, "Sensor"),
                      reference = tool_index(t.recording, "Reference");
    const std::size_t samples = t.recording.samples.size();
    for (std::size_t k = samples / 3; k < samples / 3 + 12; ++k)
        t.recording.samples[k].poses[sensor].status = PoseStatus::missing;
    t.recording.samples[samples / 2].poses[sensor].translation +=
        Vector3(0.3, 0, 0);  // one jump of 300 mm
    for (std::size_t k = samples / 2 + 5; k < samples / 2 + 8; ++k)
        t.recording.samples[k].poses[reference].status = PoseStatus::invalid;
    const ResultReader result = t.run();
    for (std::size_t k = 0; k < result.frame_count(); ++k)
        ASSERT_LT(largest(result.displacement(k)), 0.03);
}

TEST(Track, AtTheRecordingsOwnPaceEachSampleIsAFrameOrMissed) {
    Tracked t;
    t.tracker.rest_s = 2;
    t.tracker.pause_s = 0.2;
    t.record();
    const ResultReader result = t.run("--json report.json");
    const auto run = nlohmann::json::parse(result.text("run"));
    EXPECT_EQ(run["samples"].get<std::size_t>(), t.recording.samples.size());
    EXPECT_EQ(run["frames"].get<std::size_t>() + run["missed"].get<std::size_t>(),
              t.recording.samples.size());
    EXPECT_GT(result.frame_count(), 5u);
    EXPECT_TRUE(std::filesystem::exists(t.folder / "report.json"));
}

/// A grid that is cut beside the sensor, halfway down: the cut opens, the errors at a target are
/// stated with that of the elements, and a replay is the same to the bit.
TEST(Track, AGridThatIsCutOpensAndIsReplayed) {
    Tracked t;
    write_hierarchy(t.folder / "block.h5",
                    make_hierarchy({test::hex_grid({20, 10, 10}, {0.2, 0.1, 0.1})}, "a grid"));
    t.set_track("targets: [{name: Under, point_mm: [100, 50, 80]}]");
    write_text(t.folder / "scene.yaml",
               read_text_file(t.folder / "scene.yaml") +
                   "strain: neohookean\n"
                   "cuts: [{point_mm: [140, 50, 100], edges_mm: [0, 120, 0, 0, 0, 100]}]\n");
    t.record();
    const ResultReader result = t.run("--every-sample --json report.json");
    const auto run = nlohmann::json::parse(result.text("run"));
    EXPECT_NE(run["solver"].get<std::string>().find("over hexahedra"), std::string::npos);
    EXPECT_NE(test::text_of(t.folder / "result.report" / "report.txt").find("2000 hexahedra"),
              std::string::npos);
    const TetMesh mesh = result.mesh();
    EXPECT_GT(mesh.nodes.size(), 21U * 11 * 11);
    // Of the nodes at each place of the cut's upper end, how far they part.
    double widest = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const auto u = result.displacement(k);
        for (std::size_t n = 21 * 11 * 11; n < u.size(); ++n)
            for (std::size_t m = 0; m < 21U * 11 * 11; ++m)
                if (mesh.nodes[m] == mesh.nodes[n]) widest = std::max(widest, (u[n] - u[m]).norm());
    }
    EXPECT_GT(widest, 1e-3);
    EXPECT_LT(widest, 0.015);
    const StatementReader statements(result, "result.h5");
    bool elements_known = false;
    for (std::size_t k = 0; k < result.frame_count(); ++k)
        elements_known = elements_known || !statements.read(k).missing.has(ErrorSource::elements);
    EXPECT_TRUE(elements_known);
    EXPECT_EQ(livetet(t.folder, "track --replay result.h5").status, 0);
}

TEST(Track, ABudgetThatNothingFitsLeavesOneIterationAFrameAndSaysSo) {
    Tracked t;
    t.record();
    t.set_track("budget: 1e-3 ms");
    write_text(t.folder / "scene.yaml",
               read_text_file(t.folder / "scene.yaml") + "solver: {relative_tolerance: 1.0e-9}\n");
    const ResultReader hurried = t.run("--every-sample --json hurried.json");
    double cut_short = 0;
    for (std::size_t k = 20; k < hurried.frame_count(); ++k) {
        EXPECT_EQ(hurried.values("iterations", k, 1)[0], 1) << k;
        EXPECT_TRUE(std::isfinite(hurried.values("error_estimate_mm", k, 1)[0]));
        cut_short += hurried.values("cut_short", k, 1)[0];
        for (const Vector3& u : hurried.displacement(k)) ASSERT_TRUE(u.norm() < 0.05);
    }
    EXPECT_GT(cut_short, 0.9 * static_cast<double>(hurried.frame_count() - 20));
    const auto report = nlohmann::json::parse(read_text_file(t.folder / "hurried.json"));
    EXPECT_EQ(report["frames"]["budget_ms"], 1e-3);
    EXPECT_GE(report["frames"]["cut_short"], cut_short);
    EXPECT_EQ(report["frames"]["over_budget"], hurried.frame_count());
}

TEST(Track, ASensorThatIsNotOnTheOrganIsRefused) {
    Tracked t;
    t.tracker.image_from_sensor_at_rest.translation = {0.1, 0.05, 0.2};
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    test::expect_refused(livetet(t.folder, "track scene.yaml --every-sample"),
                         {"Sensor", "off the organ's surface"});
    EXPECT_FALSE(std::filesystem::exists(t.folder / "result.h5"));
}

TEST(Track, ASensorThatNeverRestsIsNotFollowedAndTheReportSaysSo) {
    Tracked t;
    t.tracker.position_rms_mm = t.tracker.rotation_rms_deg = 0;
    t.tracker.press_depth = 0;
    t.record();
    const std::size_t sensor = tool_index(t.recording, "Sensor");
    for (TrackerSample& s : t.recording.samples)  // to and fro, within the scatter of a base
        s.poses[sensor].translation += Vector3(0, 6e-3 * std::sin(2 * M_PI * s.time_s), 0);
    const ResultReader result = t.run("--every-sample --json report.json");
    for (std::size_t k = 0; k < result.frame_count(); ++k)
        ASSERT_EQ(largest(result.displacement(k)), 0) << k;
    const auto report = nlohmann::json::parse(read_text_file(t.folder / "report.json"));
    EXPECT_EQ(report["sensors"]["unplaced"], 1);
    EXPECT_NE(test::text_of(t.folder / "stdout.txt").find("1 of 1 NOT placed"), std::string::npos);
}

/// Moves the sensor along the top of the block by 10 mm within 0.5 s.
void slide(Tracked& t, double begin_s) {
    const std::size_t sensor = tool_index(t.recording, "Sensor");
    for (TrackerSample& s : t.recording.samples)
        s.poses[sensor].translation += 0.01 * std::clamp((s.time_s - begin_s) / 0.5, 0.0, 1.0) *
                                       true_tracker_from_image(t.tracker, s.time_s).rotation.col(0);
}

TEST(Track, ASensorThatSlipsIsToldLetGoAndPlacedAnew) {
    Tracked t;
    t.tracker.press_depth = 0;
    t.tracker.hold_s = 8;
    t.set_track("position_noise_mm: 1.4, targets: [{name: Under, point_mm: [100, 50, 80]}]");
    t.record();
    const double begin_s = 3;
    slide(t, begin_s);
    const ResultReader result = t.run("--every-sample --json report.json");
    const StatementReader statements(result, "result.h5");
    const std::size_t sensor = tool_finder(nlohmann::json::parse(result.text("tools")))("Sensor");
    std::optional<double> told_s;
    bool was_placing = false;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const double time = result.times_s()[k];
        const auto slips = static_cast<std::uint64_t>(result.values("slipped", k, 1)[0]);
        const bool slipped = is_slipped(slips, sensor);
        EXPECT_EQ(slips != 0, slipped);
        const std::vector<double> sensors = result.values("sensors", k, 6);
        if (slipped && !told_s) told_s = time;
        EXPECT_TRUE(!slipped || time > begin_s) << "noise is none, " << time;
        if (slipped || (told_s && sensors[0] == 1)) {
            EXPECT_TRUE(statements.read(k).missing.has(ErrorSource::sensors)) << time;
        }
        if (told_s && time > *told_s + 1.6) {
            EXPECT_FALSE(slipped) << time;
            was_placing = was_placing || sensors[0] == 1;
        }
        if (told_s && time > *told_s + 4) {
            EXPECT_EQ(sensors[1], 1) << "placed anew and followed, " << time;
            EXPECT_LT(largest(result.displacement(k)), 0.004) << "by noise alone, " << time;
        }
    }
    ASSERT_TRUE(told_s);
    EXPECT_LT(*told_s, begin_s + 1);
    EXPECT_TRUE(was_placing);
    const ErrorSources missing = statements.read(result.frame_count() - 1).missing;
    EXPECT_FALSE(missing.has(ErrorSource::sensors)) << "the new patch's are known";
    EXPECT_GT(result.times_s().back(), *told_s + 5) << "else this test shows nothing";
    const auto report = nlohmann::json::parse(read_text_file(t.folder / "report.json"));
    EXPECT_EQ(report["sensors"]["slips"], 1);
    EXPECT_NE(test::text_of(t.folder / "stdout.txt").find("slipped over the organ 1 time"),
              std::string::npos);
    const auto replay = livetet(t.folder, "track --replay result.h5");
    EXPECT_EQ(replay.status, 0) << replay.out;
}

TEST(Track, ASensorThatMayNotSlipPullsTheOrganSideways) {
    Tracked t;
    t.tracker.position_rms_mm = t.tracker.rotation_rms_deg = t.tracker.press_depth = 0;
    t.set_track("sensors: [{tool: Sensor, may_slip: false}]");
    t.tracker.hold_s = 3;
    t.record();
    slide(t, 3);
    const ResultReader result = t.run();
    for (std::size_t k = 0; k < result.frame_count(); ++k)
        EXPECT_EQ(result.values("slipped", k, 1)[0], 0) << k;
    EXPECT_NEAR(result.values("press_mm", result.frame_count() - 1, 1)[0], 10, 0.5);
}

TEST(Track, ANoisyPressIsNoSlip) {
    for (const double tilt_deg : {0, 30}) {
        Tracked t;
        t.set_track("position_noise_mm: 1.4");
        t.tracker.press_depth = 0.02;
        const double tilt = tilt_deg * radians_per_degree;
        t.tracker.press_direction = {std::sin(tilt), 0, -std::cos(tilt)};
        t.record();
        const ResultReader result = t.run();
        double press_mm = 0;
        for (std::size_t k = 0; k < result.frame_count(); ++k) {
            EXPECT_EQ(result.values("slipped", k, 1)[0], 0) << tilt_deg << " degrees, frame " << k;
            press_mm = std::max(press_mm, result.values("press_mm", k, 1)[0]);
        }
        EXPECT_GT(press_mm, 15) << "else nothing is judged";
    }
}

TEST(Track, WarnsOfElementsThatLock) {
    Tracked t;
    t.tracker.hold_s = 0.2;
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    const std::string scene = test::text_of(t.folder / "scene.yaml");
    for (const char* formulation : {"displacement", "automatic"}) {
        write_text(t.folder / "scene.yaml",
                   scene + fmt::format("materials: [{{young_Pa: 3000, poisson: 0.495}}]\n"
                                       "formulation: {}\n",
                                       formulation));
        const auto outcome =
            livetet(t.folder, "track scene.yaml --every-sample --json report.json");
        const std::string report = test::text_of(t.folder / "report.json"),
                          explained = livetet(t.folder, "explain scene.yaml").out;
        for (const std::string& text : {outcome.err, report, explained})
            EXPECT_EQ(text.find("lock near 0.5 and are too stiff. Reactions") != std::string::npos,
                      formulation == std::string_view("displacement"))
                << text;
    }
}

TEST(Track, ARecordingWithoutTheNamedSensorIsRefused) {
    Tracked t;
    t.record();
    t.recording.tools = {"Reference", "Probe"};
    write_sequence(t.folder / "press.igs.mha", t.recording);
    test::expect_refused(livetet(t.folder, "track scene.yaml"),
                         {"Sensor", "Reference", "Probe", "track.sensors, by default Sensor"});
}

TEST(Track, ALostSensorsPatchIsLetGoAndTheBodyComesHome) {
    Tracked t;
    t.tracker.position_rms_mm = t.tracker.rotation_rms_deg = 0;
    t.tracker.hold_s = 6;
    t.record();
    const std::size_t sensor = tool_index(t.recording, "Sensor");
    const double lost_s = t.tracker.rest_s + t.tracker.ramp_s + 0.5;
    for (TrackerSample& s : t.recording.samples)
        if (s.time_s > lost_s) s.poses[sensor].status = PoseStatus::missing;
    const ResultReader result = t.run();
    double at_hold = 0, last = 0, max_in_a_frame = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const double time = result.times_s()[k], now = largest(result.displacement(k));
        if (time > lost_s && time < lost_s + 0.45) {
            EXPECT_EQ(result.values("sensors", k, 6)[3], 1) << "holding";
            at_hold = now;
        }
        if (time > lost_s) max_in_a_frame = std::max(max_in_a_frame, std::abs(now - last));
        if (time > lost_s + 1.7) {
            EXPECT_EQ(result.values("sensors", k, 6)[5], 1) << "released";
        }
        if (time > lost_s + 3) {
            EXPECT_LT(now, 0.05 * 0.015) << "free, and not held at rest: it swings home";
        }
        last = now;
    }
    EXPECT_NEAR(at_hold, 0.015, 0.001);
    EXPECT_LT(max_in_a_frame, 0.25 * 0.015) << "no jump when it is let go";
}

TEST(Track, EachSensorMovesItsOwnPatchAndASoftOneLess) {
    Tracked t;
    t.tracker.position_rms_mm = t.tracker.rotation_rms_deg = 0;
    t.record();
    t.recording.tools.push_back("Second");
    RigidTransform<ImageFrame, Sensor> image_from_second;
    image_from_second.translation = {0.15, 0.05, 0.1};
    for (TrackerSample& s : t.recording.samples)
        s.poses.push_back(
            pose_of(true_tracker_from_image(t.tracker, s.time_s) * image_from_second));
    const double deepest_s = t.tracker.rest_s + t.tracker.ramp_s + 0.5 * t.tracker.hold_s;
    const auto moved = [&](const std::string& sensors, const Vector3& place) {
        t.set_track("sensors: [" + sensors + "]");
        const ResultReader result = t.run();
        const auto& times = result.times_s();
        const auto k = static_cast<std::size_t>(
            std::lower_bound(times.begin(), times.end(), deepest_s) - times.begin());
        const Vector3 places[] = {place};
        return interpolate(map_into(result.mesh(), places), 0, result.displacement(k)).norm();
    };
    const Vector3 first(0.1, 0.05, 0.1), second = image_from_second.translation;
    const double alone = moved("{tool: Sensor}", second);
    EXPECT_GT(alone, 5e-4) << "pressed 50 mm away it goes along, else this test shows nothing";
    EXPECT_LT(moved("{tool: Sensor}, {tool: Second}", second), 0.01 * alone)
        << "a sensor that stays holds its patch";
    const double hard = moved("{tool: Sensor}", first);
    EXPECT_NEAR(hard, 0.015, 1e-4);
    const double soft = moved("{tool: Sensor, stiffness_N_per_m: 50}", first);
    const double stiff = moved("{tool: Sensor, stiffness_N_per_m: 20000}", first);
    EXPECT_LT(soft, 0.8 * hard);
    EXPECT_GT(soft, 0.1 * hard);
    EXPECT_GT(stiff, 0.95 * hard);
    EXPECT_LT(stiff, hard);
    // Where patches overlap, the mean: the first goes 15 mm, the second stays.
    const double between =
        moved("{tool: Sensor, patch_radius_mm: 55}, {tool: Second, patch_radius_mm: 10}", second);
    EXPECT_NEAR(between, 0.0075, 1e-4);
}

TEST(Track, AReplayGivesTheSameFramesToTheBitAndSaysWhereNot) {
    Tracked t;
    t.record();
    t.set_track("budget: 0.7 ms");  // some frames are cut short, some are not
    t.run("");
    auto outcome = livetet(t.folder, "track --replay result.h5");
    const std::string all = std::to_string(ResultReader(t.folder / "result.h5").frame_count());
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    EXPECT_NE(outcome.out.find(all + " of " + all + " frames are the same to the bit"),
              std::string::npos)
        << outcome.out;

    const TetMesh finest = test::block({12, 6, 6}, {0.2, 0.1, 0.1});
    write_hierarchy(
        t.folder / "block.h5",
        make_hierarchy({finest, test::block({5, 3, 3}, {0.2, 0.1, 0.1})}, "other levels"));
    outcome = livetet(t.folder, "track --replay result.h5");
    EXPECT_EQ(outcome.status, 3) << "another preconditioner, other bits: " << outcome.out;
    EXPECT_NE(outcome.out.find("the first other one is frame"), std::string::npos) << outcome.out;
    write_hierarchy(t.folder / "block.h5",
                    make_hierarchy({test::block({11, 6, 6}, {0.2, 0.1, 0.1})}, "another mesh"));
    test::expect_refused(livetet(t.folder, "track --replay result.h5"),
                         {"result.h5", "block.h5", "not the mesh"});
}

/// This one has PETSc iterate, with other roundings.
TEST(Track, AReplayHeedsThePetscOptionsOfItsScene) {
    Tracked t;
    t.record();
    const auto scene = t.folder / "scene.yaml";
    write_text_file(scene, read_text_file(scene) +
                               "solver: {petsc_options: \"-ksp_norm_type unpreconditioned\"}\n");
    t.run();
    const auto outcome = livetet(t.folder, "track --replay result.h5");
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
}

/// With `ahead_ms: auto` each frame has a time of its own, which the clock decides; never the same
/// again, so a replay takes it from the result.
TEST(Track, PredictsToWhenAFrameIsShownAndAReplayRepeatsIt) {
    Tracked t;
    t.tracker.hold_s = 0.2;
    t.record();
    t.set_track("position_noise_mm: 1.4, ahead_ms: auto, display_ms: 30");
    const ResultReader result = t.run("--json report.json");
    EXPECT_EQ(result.values("ahead_s", 0, 1)[0], 0.03) << "no frame was shown yet";
    for (std::size_t k = 1; k < result.frame_count(); ++k) {
        EXPECT_GT(result.values("ahead_s", k, 1)[0], 0.03) << k;
        EXPECT_LE(result.values("ahead_s", k, 1)[0], 0.1) << k;
    }
    const auto report = nlohmann::json::parse(read_text_file(t.folder / "report.json"));
    EXPECT_GT(report["frames"]["ahead_ms"]["median"], 30);
    const auto replay = livetet(t.folder, "track --replay result.h5");
    EXPECT_EQ(replay.status, 0) << replay.out << replay.err;

    const ResultReader every_sample = t.run("--every-sample");
    for (std::size_t k = 0; k < every_sample.frame_count(); ++k)
        ASSERT_EQ(every_sample.values("ahead_s", k, 1)[0], 0) << "nobody waits for these frames";
}

TEST(Track, SensorsAndFixedNodesMayChangeWhileItRuns) {
    Tracked t;
    t.tracker.position_rms_mm = t.tracker.rotation_rms_deg = 0;
    t.tracker.hold_s = 7;
    t.record();
    const auto edit = [&](const std::string& from, const std::string& to) {
        std::string scene = read_text_file(t.folder / "scene.yaml");
        scene.replace(scene.find(from), from.size(), to);
        write_text_file(t.folder / "scene.yaml", scene);
    };
    t.set_track("sensors: [{tool: Sensor}]");
    std::thread editor(
        [&] {  // by the recording's own clock, which starts when the program does, about
            const auto after = [](double seconds) {
                std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
            };
            after(t.tracker.rest_s + t.tracker.ramp_s + 1);
            edit("{tool: Sensor}", "{tool: Sensor, no_such_key: 1}");
            after(1);
            edit("[{tool: Sensor, no_such_key: 1}]", "[]");
            after(2.5);
            edit("fix: [", "fix: [{half_space_mm: [0, 0, 99, 0, 0, -1]}, ");
        });
    const ResultReader result = t.run("");
    editor.join();
    const std::string said = test::text_of(t.folder / "stderr.txt");
    EXPECT_NE(said.find("no_such_key"), std::string::npos) << said;
    const auto events = nlohmann::json::parse(result.text("replay"))["events"];
    ASSERT_EQ(events.size(), 2u) << said;
    const auto removed = events[0]["frame"].get<std::size_t>(),
               fixed = events[1]["frame"].get<std::size_t>();
    EXPECT_NEAR(largest(result.displacement(removed - 1)), 0.015, 1e-3)
        << "what is wrong in the file changes nothing";
    EXPECT_LT(largest(result.displacement(fixed - 1)), 1e-3) << "removed, it is let go";
    const std::vector<Vector3> last = result.displacement(result.frame_count() - 1);
    for (std::size_t n = 0; n < last.size(); ++n)
        if (result.mesh().nodes[n].z() > 0.0995) {
            ASSERT_EQ(last[n], Vector3::Zero()) << "the top is fixed now";
        }
    const auto outcome = livetet(t.folder, "track --replay result.h5");
    EXPECT_EQ(outcome.status, 0) << "with its changes: " << outcome.out;
}

TEST(Track, OnAFullDiskItGoesOnAndKeepsWhatItHas) {
    Tracked t;
    t.tracker.hold_s = 20;
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    // A disk of 6 MB, in blocks of 512 bytes.
    const auto outcome =
        livetet(t.folder, "track scene.yaml --every-sample", "trap '' XFSZ && ulimit -f 12288 &&");
    EXPECT_EQ(outcome.status, 2);
    EXPECT_NE(outcome.err.find("nothing is recorded from here on; tracking continues"),
              std::string::npos)
        << outcome.err;
    const ResultReader result(t.folder / "result.h5");
    EXPECT_GT(result.frame_count(), 20u);
    const auto run = nlohmann::json::parse(result.text("run"));
    EXPECT_EQ(run["frames"].get<std::size_t>(), t.recording.samples.size()) << "tracked to its end";
    EXPECT_EQ(run["not_kept"].get<std::size_t>(),
              t.recording.samples.size() - result.frame_count());
    EXPECT_NE(run["problem"].get<std::string>().find("no room"), std::string::npos);
    EXPECT_NE(outcome.err.find(fmt::format("holds {} frames before that", result.frame_count())),
              std::string::npos)
        << outcome.err;
    test::expect_refused(livetet(t.folder, "track --replay result.h5"),
                         {"result.h5", "lacks", "expected all of them"});
}

TEST(Track, WhoReadsItsMessagesMayGo) {
    Tracked t;
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    write_text(t.folder / "gone", "exec 3> >(head -n 1 >head.txt)\nexec \"$@\" 2>&3\n");
    const auto outcome = livetet(t.folder, "track scene.yaml --every-sample", "bash gone");
    EXPECT_EQ(outcome.status, 0) << outcome.out;
    EXPECT_EQ(ResultReader(t.folder / "result.h5").frame_count(), t.recording.samples.size());
}

TEST(Track, WhatCannotBeASourceIsRefused) {
    Tracked t;
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    for (const char* source :
         {"openigtlink://", "openigtlink://host:0", "openigtlink://host:port",
          "openigtlink://host:70000", "http://localhost", "openigtlink://[::1"}) {
        t.set_source(source);
        test::expect_refused(livetet(t.folder, "track scene.yaml"),
                             {source, "openigtlink://host:port"});
    }
    t.set_source("press.igs.mha");
    t.set_track("sensors: [{tool: Sensor}, {tool: Sensor}]");
    test::expect_refused(livetet(t.folder, "track scene.yaml"), {"Sensor is named twice"});
    t.set_track("tools: [{tool: StylusTip}, {tool: Stylus, tip: stylus.json}]");
    test::expect_refused(livetet(t.folder, "track scene.yaml"),
                         {"track.tools: Stylus", "StylusTipToRAS"});
    t.set_track("smoothing_Hz: 0, ahead_ms: 40");
    test::expect_refused(livetet(t.folder, "track scene.yaml"),
                         {"track.ahead_ms = 40", "smoothing_Hz = 0"});
    t.set_track("smoothing_Hz: 2, ahead_ms: auto");
    test::expect_refused(livetet(t.folder, "track scene.yaml"),
                         {"track.ahead_ms = auto", "smoothing_Hz = 2"});
    t.set_track("position_noise_mm: 1, ahead_ms: soon");
    test::expect_refused(livetet(t.folder, "track scene.yaml"),
                         {"track.ahead_ms = soon", "a number, or auto"});
    t.set_track("position_noise_mm: 1, ahead_ms: 40, display_ms: 20");
    test::expect_refused(livetet(t.folder, "track scene.yaml"),
                         {"track.display_ms = 20", "track.ahead_ms = auto"});
    t.set_track("position_noise_mm: 0");
    test::expect_refused(livetet(t.folder, "track scene.yaml"),
                         {"track.position_noise_mm = 0", "from 0.01 to 100"});
    t.set_track("rotation_noise_deg: -0.5");
    test::expect_refused(livetet(t.folder, "track scene.yaml"),
                         {"track.rotation_noise_deg = -0.5", "from 0.001 to 45"});
    write_tip(t.folder / "stylus.json", {"Stylus", {}, {}});
    t.set_track("tools: [{tool: Sensor, tip: stylus.json}]");
    test::expect_refused(livetet(t.folder, "track scene.yaml"),
                         {"stylus.json", "is the tip of Stylus", "that of Sensor"});
    t.set_track("");
    test::expect_refused(livetet(t.folder, "track scene.yaml --publish 70000"),
                         {"--publish 70000", "65535"});
    test::expect_refused(livetet(t.folder, "track"), {"--replay"});
}

/// The lines of a CSV, split, without its head.
std::vector<std::vector<std::string>> rows_of(const std::filesystem::path& path) {
    std::vector<std::vector<std::string>> rows;
    const std::string text = test::text_of(path);
    for (const std::string_view line : split_lines(text))
        if (!line.empty()) rows.push_back(split_csv(line).value());
    if (!rows.empty()) rows.erase(rows.begin());
    return rows;
}

TEST(Track, ProbesAreWrittenFrameByFrame) {
    Tracked t;
    t.tracker.hold_s = 0.5;
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    const Vector3 top(0.1, 0.05, 0.1);  // a node, where the sensor presses
    write_text(t.folder / "points.csv", "name,x_mm,y_mm,z_mm\ntop,100,50,100\nlow,100,50,0\n");
    const std::string scene = test::text_of(t.folder / "scene.yaml") +
                              "probes: {points: points.csv, displacements: moved.csv}\n";
    write_text(t.folder / "scene.yaml", scene + "output: {every: 2}\n");
    const ResultReader result = t.run_as_it_is();
    const auto rows = rows_of(t.folder / "moved.csv");
    ASSERT_EQ(rows.size(), 2 * result.frame_count());
    const auto& nodes = result.mesh().nodes;
    const auto node = static_cast<std::size_t>(
        std::find_if(nodes.begin(), nodes.end(),
                     [&](const Vector3& x) { return (x - top).norm() < 1e-9; }) -
        nodes.begin());
    double deepest_mm = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const std::vector<std::string>& row = rows[2 * k];
        ASSERT_EQ(row.size(), 8u);
        EXPECT_EQ(row[1], "top");
        EXPECT_EQ(rows[2 * k + 1][1], "low");
        EXPECT_EQ(std::stod(row[0]), result.times_s()[k]);
        EXPECT_NEAR(std::stod(row[7]), 1e3 * result.displacement(k)[node].z(), 1e-4) << k;
        EXPECT_EQ(std::stod(rows[2 * k + 1][7]), 0) << "fixed";
        deepest_mm = std::min(deepest_mm, std::stod(row[7]));
    }
    EXPECT_NEAR(deepest_mm, -15, 2);

    std::filesystem::remove(t.folder / "moved.csv");
    write_text(t.folder / "scene.yaml", scene + "output: {file: none}\n");
    const auto outcome = livetet(t.folder, "track scene.yaml --every-sample");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(rows_of(t.folder / "moved.csv").size(), 2 * t.recording.samples.size())
        << "without a result file, too";
}

TEST(Track, WithoutARecorderNoFileIsWritten) {
    Tracked t;
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    const auto count = [&] {
        return std::distance(std::filesystem::directory_iterator(t.folder.path()), {});
    };
    write_text(t.folder / "scene.yaml",
               test::text_of(t.folder / "scene.yaml") + "\noutput: {file: none}\n");
    (void)livetet(t.folder, "scene");  // what the test itself keeps is there
    const auto before = count();
    const auto outcome = livetet(t.folder, "track scene.yaml --every-sample");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("nothing was recorded"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find(std::to_string(t.recording.samples.size()) + " frames"),
              std::string::npos)
        << outcome.out;
    EXPECT_EQ(count(), before);
}

/// Two targets in the block, followed by the pose estimator.
const char* const stated_targets =
    "position_noise_mm: 1.4, targets: [{name: Under, point_mm: [100, 50, 80]}, "
    "{name: Corner, sphere_mm: [20, 20, 20, 25]}]";

TEST(Track, StatesHowFarOffItsTargetsMayBe) {
    Tracked t;
    t.set_track(stated_targets);
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    const auto outcome = livetet(t.folder, "track scene.yaml --every-sample");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("error within"), std::string::npos) << outcome.err;

    const ResultReader result(t.folder / "result.h5");
    const StatementReader statements(result, "result.h5");
    EXPECT_EQ(statements.names(), (std::vector<std::string>{"Under", "Corner"}));
    double at_rest = 0, deepest = 0, deepest_press = 0;
    std::size_t known = 0, known_surface = 0;
    EXPECT_EQ(statements.surface_places().size(), max_places_of_surface);
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const FrameStatement s = statements.read(k);
        const double press = result.values("press_mm", k, 1)[0];
        EXPECT_GT(s.targets[0].radius_95, 1e-4);
        EXPECT_TRUE(s.computed == 1 || s.missing.has(ErrorSource::patches));
        if (!s.missing.empty()) continue;
        ++known;
        EXPECT_LT(s.targets[1].radius_95, 0.02);
        if (press < 1) at_rest = s.targets[0].radius_95;
        if (press > deepest_press) {
            deepest_press = press;
            deepest = s.targets[0].radius_95;
        }
        if (!s.surface.missing.empty()) continue;
        ++known_surface;
        const auto [least, most] = std::ranges::minmax(s.surface.radius_95);
        EXPECT_GT(least, 1e-4);
        EXPECT_LT(most, 0.05);
    }
    EXPECT_GT(known, result.frame_count() / 2);
    EXPECT_GT(known_surface, result.frame_count() / 3);
    EXPECT_GT(deepest_press, 14);
    EXPECT_GT(deepest, 1.2 * at_rest) << "a press leaves more open";

    const auto replay = livetet(t.folder, "track --replay result.h5");
    EXPECT_EQ(replay.status, 0) << replay.out;
    EXPECT_NE(replay.out.find("frames are the same to the bit"), std::string::npos) << replay.out;
}

/// The points of a file are read again, and must be those of the run.
TEST(Track, ARunWhoseTargetsHaveChangedIsNotTheSameAgain) {
    Tracked t;
    t.set_track("targets: [{points: targets.csv}]");
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    const auto write_targets = [&](const std::string& rows) {
        write_text_file(t.folder / "targets.csv", "name,x_mm,y_mm,z_mm\n" + rows);
    };
    write_targets("Vein,100,50,80\n");
    ASSERT_EQ(livetet(t.folder, "track scene.yaml --every-sample").status, 0);
    write_targets("Duct,100,50,80\n");
    test::expect_refused(livetet(t.folder, "track --replay result.h5"),
                         {"result.h5", "targets", "Duct now", "Vein then"});
    write_targets("Vein,100,50,70\n");
    const auto moved = livetet(t.folder, "track --replay result.h5");
    EXPECT_EQ(moved.status, 3) << moved.out << moved.err;
    EXPECT_NE(moved.out.find("target Vein is 10 mm from where it was"), std::string::npos)
        << moved.out;
}

/// What the filter in use or the registration does not tell is missing, and the radius smaller.
TEST(Track, NamesTheErrorsThatItCannotState) {
    Tracked t;
    t.set_track("smoothing_Hz: 1, ahead_ms: 0, targets: [{name: Under, point_mm: [100, 50, 80]}]");
    t.record();
    FiducialRegistration registration = read_registration(t.folder / "registration.json");
    registration.expected_error.reset();
    write_registration(t.folder / "registration.json", registration);
    const ResultReader result = t.run();
    const FrameStatement last = StatementReader(result, "result.h5").read(result.frame_count() - 1);
    for (const ErrorSource source : {ErrorSource::reference, ErrorSource::fiducials,
                                     ErrorSource::sensors, ErrorSource::patches})
        EXPECT_TRUE(last.missing.has(source)) << name_of(source);
    EXPECT_FALSE(last.missing.has(ErrorSource::elements));
}

TEST(Track, RefusesTargetsThatAreNone) {
    Tracked t;
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    struct Case {
        const char *target, *says, *also;
    };
    for (const auto& [target, says, also] :
         {Case{"{name: Far, point_mm: [300, 50, 80]}", "track.targets: Far", "outside the mesh"},
          {"{point_mm: [100, 50, 80]}", "track.targets[0].name is missing", "scene.yaml"},
          {"{name: A, point_mm: [9, 9, 9], group: x}", "track.targets[0]", "expected one"},
          {"{name: A}", "track.targets[0]", "names 0 of point_mm, points and a selection"},
          {"{name: A, sphere_mm: [1, 2]}", "track.targets[0].sphere_mm", "has 2 numbers"},
          {"{name: A, points: none.csv}", "track.targets[0].name = A", "expected no name"},
          {"{points: none.csv}", "none.csv", "no such file"},
          {"{name: A, point_mm: [9, 9, 9]}, {name: A, point_mm: [8, 8, 8]}",
           "track.targets[1].name = A", "another target"}}) {
        t.set_track(fmt::format("targets: [{}]", target));
        test::expect_refused(livetet(t.folder, "track scene.yaml"), {says, also});
    }
}

}  // namespace
}  // namespace livetet
